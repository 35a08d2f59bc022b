#include "dataset/recording_description.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iterator>
#include <limits>

#include "base/median.h"
#include "dataset/camera_choice.h"
#include "dataset/image_checks.h"
#include "dataset/recording.h"
#include "image/frame_grouping.h"
#include "rig_formats/rig_file.h"

namespace bslam::dataset {
namespace {

// Time from each image to the nearest one of the other camera.
std::vector<TimeNs> distances(const std::vector<TimeNs>& times, const std::vector<TimeNs>& others) {
  std::vector<TimeNs> out;
  for (const TimeNs time_ns : times) {
    const auto after = std::ranges::lower_bound(others, time_ns);
    TimeNs nearest = std::numeric_limits<TimeNs>::max();
    if (after != others.end()) nearest = *after - time_ns;
    if (after != others.begin()) nearest = std::min(nearest, time_ns - *std::prev(after));
    out.push_back(nearest);
  }
  return out;
}

// Finds which images of the other cameras have an image of camera 0 at the same time.
std::vector<SynchronyDescription> synchrony(const std::vector<StreamDescription>& streams, double tolerance_s) {
  std::vector<const StreamDescription*> cameras;
  for (const StreamDescription& stream : streams) {
    if (stream.camera < 0 || stream.times.empty()) continue;
    cameras.resize(std::max<std::size_t>(cameras.size(), static_cast<std::size_t>(stream.camera) + 1));
    cameras[static_cast<std::size_t>(stream.camera)] = &stream;
  }
  std::vector<SynchronyDescription> out;
  for (std::size_t c = 1; c < cameras.size() && cameras[0] != nullptr; ++c) {
    if (cameras[c] == nullptr) continue;
    const std::vector<TimeNs> apart = distances(cameras[c]->times, cameras[0]->times);
    const TimeNs tolerance_ns = from_seconds(tolerance_s);
    const auto together = std::ranges::count_if(apart, [&](TimeNs distance) { return distance <= tolerance_ns; });
    out.push_back({static_cast<int>(c), apart.size(), static_cast<std::size_t>(together),
                   1e3 * to_seconds(median(std::vector<TimeNs>(apart)))});
  }
  return out;
}

// Returns the input that is needed to run the recording besides its images.
std::vector<std::string> missing_for(const DatasetRequest& request, const Recording& recording,
                                     const std::vector<StreamDescription>& streams) {
  std::vector<std::string> missing;
  if (request.rig_file) {
    const auto rig = rig_formats::read_rig(*request.rig_file);
    if (!rig) return {rig.error().message()};
    if (request.cameras.empty() && rig->size() > recording.camera_count()) {
      missing.push_back(
          fmt::format("images of {} cameras: {} has {} cameras and the recording {}; --cameras selects "
                      "cameras of the rig",
                      rig->size(), request.rig_file->string(), rig->size(), recording.camera_count()));
    }
    for (const StreamDescription& s : streams) {
      const auto c = static_cast<std::size_t>(s.camera);  // index in the run
      const std::size_t of_rig = request.cameras.empty()      ? c
                                 : c < request.cameras.size() ? static_cast<std::size_t>(request.cameras[c])
                                                              : rig->size();
      if (s.camera < 0 || s.width == 0 || of_rig >= rig->size()) continue;
      const camera::Camera& camera = rig->camera(of_rig);
      if (camera.width == s.width && camera.height == s.height) continue;
      missing.push_back(fmt::format("the calibration of {} x {} pixels: {} is calibrated for {} x {} in {}{}", s.width,
                                    s.height, camera.name, camera.width, camera.height, request.rig_file->string(),
                                    resolution_hint(s.width, s.height, camera)));
    }
    return missing;
  }
  std::error_code error;
  if (std::filesystem::exists(request.path / "rig.yaml", error)) return missing;
  for (std::size_t c = 0; c < recording.camera_count() && missing.empty(); ++c) {
    if (const auto calibration = recording.calibration(c); !calibration)
      missing.push_back(calibration.error().message());
  }
  return missing;
}

std::string unit_text(const TimeStampOptions& options) {
  if (options.rate_hz) return fmt::format(", {:g} images per second", *options.rate_hz);
  return options.unit_ns ? fmt::format(", in units of {:g} s", to_seconds(*options.unit_ns)) : "";
}

// Counts the images that are missing between others, and says where the first one is.
std::optional<std::string> gaps_note(const std::vector<TimeNs>& times) {
  if (times.size() < 3) return std::nullopt;
  const auto interval_ns = static_cast<double>(image::median_interval(times));
  constexpr double kMostlyRegular = 0.7;
  double missing = 0, regular = 0;
  std::size_t first = 0;
  for (std::size_t k = 1; k < times.size() && interval_ns > 0; ++k) {
    const double steps = std::round(static_cast<double>(times[k] - times[k - 1]) / interval_ns);
    if (steps > 1 && missing == 0) first = k;
    missing += std::max(0.0, steps - 1);
    regular += steps == 1;
  }
  if (missing == 0 || regular < kMostlyRegular * static_cast<double>(times.size() - 1)) return std::nullopt;
  return fmt::format("{:.0f} image{} missing at {:.1f} Hz, the first {:.3f} s after its first image", missing,
                     missing == 1 ? " is" : "s are", 1e9 / interval_ns, to_seconds(times[first - 1] - times.front()));
}

// Decodes a few images of every camera, converts its time stamps as requested, and adds what is wrong with them.
void try_images(const DatasetRequest& request, const Recording& recording, RecordingDescription& out) {
  std::vector<std::vector<image_files::ImageFile>> images;
  const TimeStampOptions stamps = recording.has_times() ? TimeStampOptions() : request.time_stamps;
  for (StreamDescription& stream : out.streams) {
    if (stream.camera < 0) continue;
    auto list = recording.images(static_cast<std::size_t>(stream.camera));
    if (!list) continue;
    if (auto absent = absent_warning(list->images)) list->warnings.push_back(*std::move(absent));
    for (const std::string& warning : list->warnings) add_once(warning, out.warnings);
    if (auto note = unreadable_note(list->images)) {
      if (stream.width == 0) out.missing.push_back(stream.name + ": images that can be read");
      stream.notes.push_back(*std::move(note));
    }
    const std::string source = image_files::source_of(list->images.front());
    if (const Status s = convert_time_stamps(stamps, source, list->images); s) {
      stream.times.clear();
      for (const image_files::ImageFile& image : list->images) stream.times.push_back(image.time_ns);
      stream.stamps += unit_text(stamps);
      if (auto note = gaps_note(stream.times)) stream.notes.push_back(*std::move(note));
    } else {
      out.missing.push_back(s.error().message());
    }
    images.push_back(std::move(list->images));
  }
  if (const Status s = check_different_images(images); !s) out.missing.push_back(s.error().message());
}

// Returns the number in the recording of each camera of the run; nullopt if it cannot be determined.
std::optional<std::vector<int>> cameras_of_run(const DatasetRequest& request, const Recording& recording,
                                               RecordingDescription& out) {
  DatasetRequest with_rig = request;
  if (!with_rig.rig_file && !recording.calibrated()) with_rig.rig_file = rig_file_in_folder(request);
  if (!with_rig.rig_file) {
    const auto cameras = chosen_cameras(request.cameras, recording.camera_count());
    return cameras ? std::optional(*cameras) : std::nullopt;
  }
  const auto file = rig_formats::read_rig_file(*with_rig.rig_file);
  if (!file) return std::nullopt;
  const camera::Rig& rig = file->rig;
  const auto cameras = chosen_cameras(request.cameras, rig.size());
  if (!cameras) return std::nullopt;
  const auto recorded = recorded_cameras(with_rig, recording, *file, *cameras);
  if (recorded) return recorded->numbers;
  if (recording.has_own_names() || recording.topics().size() > rig.size())
    out.missing.push_back(recorded.error().message());
  return std::nullopt;
}

// Gives the streams the numbers of the cameras of the run.
void number_cameras(const DatasetRequest& request, const Recording& recording, RecordingDescription& out) {
  const auto cameras = cameras_of_run(request, recording, out);
  if (!cameras) return;
  for (StreamDescription& stream : out.streams) {
    if (stream.camera < 0) continue;
    const auto place = std::ranges::find(*cameras, stream.camera);
    stream.camera = place == cameras->end() ? -1 : static_cast<int>(place - cameras->begin());
  }
}

// Opens the recording as `run` does. Its error tells what else is missing.
void try_to_open(const DatasetRequest& request, const OpenRecording& opened, RecordingDescription& out) {
  const auto dataset = dataset_of(request, opened);
  if (!dataset) {
    out.refusal = dataset.error().message();
    return;
  }
  out.missing.clear();
  for (const std::string& warning : dataset->warnings) add_once(warning, out.warnings);
}

}  // namespace

Result<RecordingDescription> describe_recording(const DatasetRequest& request) {
  const auto opened = open_recording(request);
  if (!opened) return opened.error();
  RecordingDescription out = opened->recording->describe();
  if (out.format.empty()) out.format = format_name(opened->format);
  const std::vector<std::string> damage = opened->recording->warnings();
  out.warnings.insert(out.warnings.begin(), damage.begin(), damage.end());
  try_images(request, *opened->recording, out);
  number_cameras(request, *opened->recording, out);
  const bool images_fit = out.missing.empty();
  const std::vector<std::string> missing = missing_for(request, *opened->recording, out.streams);
  out.missing.insert(out.missing.end(), missing.begin(), missing.end());
  out.synchrony = synchrony(out.streams, request.sync_tolerance_s);
  try_to_open(request, *opened, out);
  for (std::size_t c = 0; images_fit && c < opened->recording->camera_count(); ++c) {
    const auto calibration = opened->recording->calibration(c);
    out.only_uncalibrated |= !calibration && calibration.error().message() == out.refusal;
  }
  return out;
}

}  // namespace bslam::dataset
