#include "dataset/dataset.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <system_error>
#include <utility>

#include "base/cores.h"
#include "base/thread_pool.h"
#include "dataset/camera_choice.h"
#include "dataset/frame_grouping.h"
#include "dataset/image_checks.h"
#include "dataset/long_pause.h"
#include "dataset/mask_folder.h"
#include "dataset/recording.h"
#include "dataset/vignette_folder.h"
#include "image/frame_grouping.h"
#include "image_decoding/image_file.h"
#include "rig_formats/rig_file.h"

namespace bslam::dataset {
namespace {

namespace fs = std::filesystem;

// Returns the name of the data set folder. Handles "DATA/mav0", "DATA/" and "." as well.
std::string name_of(const fs::path& path) {
  std::error_code error;
  fs::path whole = fs::weakly_canonical(path, error);
  if (error) whole = fs::absolute(path, error);
  if (whole.filename().empty() || whole.filename() == "mav0") whole = whole.parent_path();
  return fs::is_directory(whole, error) ? whole.filename().string() : whole.stem().string();
}

// The result of check_images() for each camera whose images are listed. It decodes one image or a few, so that the
// cameras are divided among threads.
std::vector<Status> check_all(const std::vector<Result<image_files::ImageList>>& lists, const camera::Rig& rig) {
  std::vector<Status> out(lists.size());
  ThreadPool pool(std::clamp(static_cast<int>(lists.size()), 1, processor_cores()));
  pool.for_each(lists.size(), [&](std::size_t i) {
    if (lists[i]) out[i] = check_images(lists[i]->images, rig.camera(i));
  });
  return out;
}

// Returns the images of every camera in use, with time offsets applied to the time stamps.
Result<std::vector<std::vector<image_files::ImageFile>>> collect_images(const DatasetRequest& request,
                                                                        const Recording& recording, ChosenRig& chosen) {
  std::vector<std::vector<image_files::ImageFile>> images;
  std::vector<Result<image_files::ImageList>> lists;
  for (const int camera : chosen.recorded) lists.push_back(recording.images(static_cast<std::size_t>(camera)));
  const std::vector<Status> checks = check_all(lists, chosen.rig);
  for (std::size_t i = 0; i < chosen.cameras.size(); ++i) {
    auto& list = lists[i];
    if (!list) return list.error();
    if (auto absent = absent_warning(list->images)) list->warnings.push_back(*std::move(absent));
    for (const std::string& warning : list->warnings) add_once(warning, chosen.warnings);
    const camera::Camera& camera = chosen.rig.camera(i);
    if (!checks[i]) return checks[i].error();
    if (const auto mask = image_decoding::read_mask(camera); !mask) return mask.error();
    const std::string source = image_files::source_of(list->images.front());
    if (const Status s = convert_time_stamps(request.time_stamps, source, list->images); !s) return s.error();
    if (!list->sorted) {
      if (const auto mixed = interleaved_warning(list->images)) add_once(*mixed, chosen.warnings);
    }
    if (request.masks) {
      const auto warnings = add_image_masks(*request.masks, chosen.cameras[i], camera, list->images);
      if (!warnings) return warnings.error();
      chosen.warnings.insert(chosen.warnings.end(), warnings->begin(), warnings->end());
    }
    for (image_files::ImageFile& image : list->images) image.time_ns += camera.time_offset_ns;
    images.push_back(std::move(list->images));
  }
  if (const Status s = check_different_images(images); !s) return s.error();
  return images;
}

// Returns the formats of the images of every camera in use, with the bits that the 16-bit files of all of them use: the
// same value is the same grey in every camera, also if one sees only shadow.
std::vector<image_decoding::PixelFormat> pixel_formats(const DatasetRequest& request,
                                                       const std::vector<std::vector<image_files::ImageFile>>& images) {
  std::vector<image_decoding::PixelFormat> formats(images.size());
  std::optional<int> bits;
  for (const auto& of_camera : images) bits = std::max(bits, image_decoding::bits_in_use(of_camera));
  for (std::size_t i = 0; i < images.size(); ++i) {
    formats[i].bits = bits.value_or(formats[i].bits);
    if (!request.bayer.empty()) formats[i].bayer = request.bayer[request.bayer.size() == 1 ? 0 : i];
  }
  return formats;
}

// A camera without any image during the recording of camera 0 has another clock.
Status check_common_clock(const std::vector<image_files::ImageFile>& images,
                          const std::vector<image_files::ImageFile>& reference, const std::string& name,
                          const camera::Camera& camera0, const fs::path& path) {
  const TimeNs before_ns = reference.front().time_ns - images.back().time_ns;
  const TimeNs after_ns = images.front().time_ns - reference.back().time_ns;
  const TimeNs interval_ns =
      (reference.back().time_ns - reference.front().time_ns) / std::max<TimeNs>(1, std::ssize(reference) - 1);
  const TimeNs apart_ns = std::max(before_ns, after_ns);
  if (apart_ns <= interval_ns) return {};
  return Error{path.string(), name,
               fmt::format("all images {:g} s or more {} those of {}", to_seconds(apart_ns),
                           before_ns > 0 ? "before" : "after", camera0.name),
               "time stamps of one clock for all cameras"};
}

Status group(const DatasetRequest& request, const std::vector<std::vector<image_files::ImageFile>>& images,
             Dataset& dataset) {
  const camera::Camera& camera0 = dataset.rig.camera(std::size_t{0});
  auto recorded = recorded_frames(images);
  FrameGrouping grouping =
      recorded ? *std::move(recorded) : group_frames(images, from_seconds(request.sync_tolerance_s));
  for (std::size_t i = 0; i < images.size(); ++i) {
    const std::string& name = dataset.rig.camera(i).name;
    if (grouping.shared_with_camera0[i] == 0) {
      if (const Status status = check_common_clock(images[i], images[0], name, camera0, request.path); !status)
        return status;
    }
    // A camera with more images than camera 0 has some between them.
    const auto more = std::max<std::ptrdiff_t>(0, std::ssize(images[i]) - std::ssize(images[0]));
    if (grouping.beside_camera0[i] > more) {
      dataset.warnings.push_back(fmt::format(
          "{}: {} of {} images are not within {:g} ms of an image of {} and are in frames of their own "
          "(see io.sync_tolerance)",
          name, grouping.beside_camera0[i], images[i].size(), 1e3 * to_seconds(grouping.tolerance_ns), camera0.name));
    }
  }
  dataset.frames = std::move(grouping.frames);
  dataset.first_time_ns = dataset.frames.front().time_ns;
  return {};
}

// Warns if no camera has images for so long that the recording may be two, or its clock may have been set.
void warn_of_jumps(const fs::path& path, Dataset& dataset) {
  constexpr TimeNs kIntervals = 20;
  std::vector<TimeNs> times;
  for (const FrameEntry& frame : dataset.frames) times.push_back(frame.time_ns);
  if (times.size() < 3) return;
  const TimeNs least_ns = std::max(kLongPause, kIntervals * image::median_interval(times));
  std::size_t jumps = 0, first = 0;
  for (std::size_t k = 1; k < times.size(); ++k) {
    if (times[k] - times[k - 1] > least_ns && jumps++ == 0) first = k;
  }
  if (jumps == 0) return;
  dataset.warnings.push_back(fmt::format(
      "{}: time stamps jump by {:.1f} s after {:.3f} s{}: two recordings in one, a clock that was set, or a pause "
      "(--begin and "
      "--end select a part)",
      path.string(), to_seconds(times[first] - times[first - 1]), to_seconds(times[first - 1] - dataset.first_time_ns),
      jumps > 1 ? fmt::format(", and {} more times", jumps - 1) : ""));
}

Status check_request(const DatasetRequest& request) {
  for (const auto& [name, value] : {std::pair("--begin", request.begin_s), std::pair("--end", request.end_s)}) {
    if (value && !(*value >= 0 && *value < 1e9))
      return Error{name, "", fmt::format("{}", *value), "a non-negative number of seconds"};
  }
  if (request.begin_s && request.end_s && !(*request.begin_s < *request.end_s)) {
    return Error{"--begin", "", fmt::format("{} s with --end {} s", *request.begin_s, *request.end_s),
                 "a begin before the end"};
  }
  if (!(request.sync_tolerance_s >= 0 && request.sync_tolerance_s < 1e3)) {
    return Error{"io.sync_tolerance", "", fmt::format("{}", request.sync_tolerance_s),
                 "a non-negative number of seconds"};
  }
  return {};
}

Status keep_range(const DatasetRequest& request, Dataset& dataset) {
  const double last_s = to_seconds(dataset.frames.back().time_ns - dataset.first_time_ns);
  const TimeNs begin = from_seconds(request.begin_s.value_or(0.0));
  const TimeNs end = request.end_s ? from_seconds(*request.end_s) : std::numeric_limits<TimeNs>::max();
  std::erase_if(dataset.frames, [&](const FrameEntry& frame) {
    const TimeNs time = frame.time_ns - dataset.first_time_ns;
    return time < begin || time >= end;
  });
  if (!dataset.frames.empty()) return {};
  return Error{request.begin_s ? "--begin" : "--end", "",
               fmt::format("{} s", request.begin_s ? *request.begin_s : *request.end_s),
               fmt::format("a range that contains frames, which are between 0 and {:.3f} s", last_s)};
}

// The calibration of the recording itself is used. Warns if a rig file in its folder has time offsets, which are then
// ignored.
void warn_of_times(const fs::path& file, std::vector<std::string>& warnings) {
  const auto rig = rig_formats::read_rig(file);
  if (!rig) return;
  std::vector<std::string> offsets;
  for (std::size_t c = 0; c < rig->size(); ++c) {
    const camera::Camera& camera = rig->camera(c);
    if (camera.time_offset_ns != 0)
      offsets.push_back(fmt::format("{} {:g} ms", camera.name, 1e3 * to_seconds(camera.time_offset_ns)));
  }
  if (offsets.empty()) return;
  warnings.push_back(fmt::format("{} contains time offsets ({}), which are only used with --rig {}", file.string(),
                                 fmt::join(offsets, ", "), file.string()));
}

camera::Rig with_names(const camera::Rig& rig, const std::vector<std::string>& names) {
  std::vector<camera::RigCamera> cameras;
  for (std::size_t c = 0; c < rig.size(); ++c) {
    cameras.push_back({rig.camera(c), rig.body_from_cam(c)});
    cameras.back().camera.name = names[c];
  }
  return camera::Rig(std::move(cameras), rig.cam_from_rig(0));
}

// The calibration of the recording itself has no names of cameras. Takes those of a rig file in its folder, if that has
// the same cameras.
void take_names(const fs::path& file, std::size_t camera_count, ChosenRig& chosen) {
  const auto rig = rig_formats::read_rig(file);
  if (!rig || rig->size() != camera_count) return;
  std::vector<std::string> all, used;
  for (std::size_t c = 0; c < rig->size(); ++c) all.push_back(rig->camera(c).name);
  for (std::size_t c = 0; c < chosen.rig.size(); ++c) {
    const camera::Camera &own = chosen.rig.camera(c), &named = rig->camera(static_cast<std::size_t>(chosen.cameras[c]));
    const camera::Intrinsics &k = camera::intrinsics(own.model), &other = camera::intrinsics(named.model);
    if (own.width != named.width || own.height != named.height || k.fx != other.fx || k.cx != other.cx) return;
    used.push_back(named.name);
  }
  chosen.rig = with_names(chosen.rig, used);
  if (chosen.whole && chosen.whole->size() == all.size()) chosen.whole = with_names(*chosen.whole, all);
}

// A recording may contain a part of the rig with which it was made. Its cameras then keep their numbers in that rig.
void number_as_recorded(const Recording& recording, Dataset& dataset) {
  for (int& camera : dataset.cameras_used) {
    const int number = recording.number_in_rig(static_cast<std::size_t>(camera));
    if (number != camera) dataset.whole_rig.reset();
    camera = number;
  }
}

// Sets the meaning of pixel values: the formats of the images and the vignettes of the cameras.
Status describe_pixels(const DatasetRequest& request, const std::vector<std::vector<image_files::ImageFile>>& images,
                       Dataset& dataset) {
  if (!(request.bayer.size() <= 1 || request.bayer.size() == images.size())) {
    return Error{"--bayer", "", fmt::format("{} patterns", request.bayer.size()),
                 fmt::format("one for all cameras, or one for each of the {} in use", images.size())};
  }
  dataset.pixel_formats = pixel_formats(request, images);
  if (!request.vignettes) return {};
  auto vignettes = read_vignettes(dataset.rig, dataset.cameras_used, *request.vignettes);
  if (!vignettes) return vignettes.error();
  dataset.vignettes = *std::move(vignettes);
  return {};
}

// The unit of time stamps is unknown unless the recording defines it.
Status check_time_stamps(const DatasetRequest& request, const OpenRecording& opened) {
  const TimeStampOptions& options = request.time_stamps;
  if (!opened.recording->has_times() || !(options.rate_hz || options.unit_ns)) return {};
  const bool kitti = opened.format == DatasetFormat::kKitti;
  return Error{options.rate_hz ? "--rate" : "--stamp-unit", "",
               kitti ? "a data set with times.txt" : "a recording with times of its own",
               kitti ? "no unit, since times.txt contains seconds" : "no unit"};
}

// Takes the masks of whole cameras from a folder.
Status use_masks(const DatasetRequest& request, const Recording& recording, ChosenRig& chosen) {
  if (!request.masks) return {};
  auto masked = with_masks(chosen.rig, chosen.cameras, *request.masks);
  if (!masked) return masked.error();
  chosen.rig = *std::move(masked);
  const auto unused = masks_not_used(*request.masks, chosen.whole ? chosen.whole->size() : recording.camera_count());
  chosen.warnings.insert(chosen.warnings.end(), unused.begin(), unused.end());
  return {};
}

}  // namespace

Result<Dataset> open_dataset(const DatasetRequest& request) {
  if (const Status status = check_request(request); !status) return status.error();
  const auto opened = open_recording(request);
  if (!opened) return opened.error();
  return dataset_of(request, *opened);
}

Result<Dataset> dataset_of(const DatasetRequest& original, const OpenRecording& opened) {
  DatasetRequest request = original;
  if (const Status status = check_request(request); !status) return status.error();
  const Recording& recording = *opened.recording;
  const auto own_rig_file = request.rig_file ? std::nullopt : rig_file_in_folder(request);
  if (own_rig_file && !recording.calibrated()) request.rig_file = *own_rig_file;
  if (const Status status = check_time_stamps(request, opened); !status) return status.error();
  const bool given = request.rig_file || (request.rig_of_map && !recording.calibrated());
  auto chosen = given ? choose_given(request, recording) : choose_own(request, recording);
  if (!chosen) return chosen.error();
  if (const Status s = use_masks(request, recording, *chosen); !s) return s.error();
  if (const Status s = given ? Status() : recording.check_calibration(chosen->rig); !s) return s.error();
  if (own_rig_file && !request.rig_file) {
    warn_of_times(*own_rig_file, chosen->warnings);
    take_names(*own_rig_file, recording.camera_count(), *chosen);
  }
  const std::vector<std::string> damage = recording.warnings();
  chosen->warnings.insert(chosen->warnings.begin(), damage.begin(), damage.end());
  const auto images = collect_images(request, recording, *chosen);
  if (!images) return images.error();
  Dataset dataset{name_of(request.path),
                  opened.format,
                  std::move(chosen->rig),
                  std::move(chosen->cameras),
                  std::move(chosen->whole),
                  0,
                  {},
                  recording.ground_truth(),
                  std::move(chosen->warnings)};
  for (const std::vector<image_files::ImageFile>& of_camera : *images) {
    const image_files::ImageFile& image = of_camera.front();
    dataset.sources.push_back(image.store ? image.store->stream(image.entry) : image_files::source_of(image));
  }
  dataset.sources_by_name = chosen->by_name;
  dataset.sources_by_topic = chosen->by_topic;
  dataset.rig_topics = std::move(chosen->rig_topics);
  if (const Status status = describe_pixels(request, *images, dataset); !status) return status.error();
  if (!request.rig_file) number_as_recorded(recording, dataset);
  if (const Status status = group(request, *images, dataset); !status) return status.error();
  if (const Status status = keep_range(request, dataset); !status) return status.error();
  warn_of_jumps(request.path, dataset);
  return dataset;
}

}  // namespace bslam::dataset
