#include "map_export/image_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <iterator>
#include <limits>
#include <map>
#include <set>
#include <utility>

#include "image_decoding/image_file.h"
#include "map/rigs_of_map.h"
#include "map_export/shown_keypoints.h"

namespace bslam::map_export {
namespace {

// The image of a keyframe shows at least 98 % of its keypoints, also if it was compressed since then, and an image from
// a few centimetres beside it at most 52 %.
constexpr double kMostly = 0.75;

struct RecordedImage {
  const image_files::ImageFile* image;
  std::size_t camera;  // index in the recording
};

// Names come from files that may contain anything.
std::string without_control_characters(std::string name) {
  std::ranges::replace_if(
      name, [](unsigned char c) { return c < 0x20 || c == 0x7f; }, '_');
  return name;
}

// A folder for the images of each camera.
std::vector<std::string> folders_of(const camera::Rig& rig) {
  std::vector<std::string> folders;
  for (std::size_t c = 0; c < rig.size(); ++c) {
    std::string name = without_control_characters(rig.camera(c).name);
    std::ranges::replace(name, '/', '_');
    if (name.empty() || name == "." || name == "..") name = fmt::format("cam{}", c);
    const std::string base = name;
    for (int i = 2; std::ranges::count(folders, name) > 0; ++i) name = fmt::format("{}_{}", base, i);
    folders.push_back(name);
  }
  return folders;
}

// The path below a folder: "_" replaces "..", and an absolute path begins there.
std::filesystem::path below_folder(const std::filesystem::path& path) {
  std::filesystem::path out;
  for (const std::filesystem::path& part : path.lexically_normal().relative_path()) out /= part == ".." ? "_" : part;
  return out;
}

image_decoding::PixelFormat format_of(const dataset::Dataset& data, std::size_t camera) {
  return camera < data.pixel_formats.size() ? data.pixel_formats[camera] : image_decoding::PixelFormat();
}

// The images of each camera of the map by their time stamps in ns. The cameras of the recording are those of each rig
// of the map with their calibrations. If there is none, they are recognised by their names, and, if a name is unknown
// and the numbers of cameras are equal, by their numbers.
class RecordedImages {
 public:
  // `data`: null if there is no recording.
  RecordedImages(const map::BundledMap& map, const dataset::Dataset* data) : by_time_(map.rig().size()) {
    if (!data) return;
    std::vector<std::optional<std::size_t>> recorded = map::find_cameras(map, data->rig);
    const bool known = std::ranges::any_of(recorded, [](const auto& camera) { return camera.has_value(); });
    for (std::size_t c = 0; c < by_time_.size(); ++c) {
      if (!known) recorded[c] = camera_of(map.rig(), c, data->rig);
      if (recorded[c]) collect(*data, *recorded[c], by_time_[c]);
    }
  }

  const RecordedImage* at(std::size_t camera, TimeNs stamp_ns) const {
    constexpr TimeNs kRounding = 1000;  // a time offset that is not a whole number of nanoseconds
    const auto next = by_time_[camera].lower_bound(stamp_ns - kRounding);
    return next != by_time_[camera].end() && next->first <= stamp_ns + kRounding ? &next->second : nullptr;
  }

  // The image whose stamp is by far the nearest one. A run corrects the capture times of images whose stamps are wrong
  // by some milliseconds (frame::CameraFrame::correction_ns).
  const RecordedImage* near(std::size_t camera, TimeNs stamp_ns) const {
    constexpr TimeNs kMostCorrected = 20'000'000;
    constexpr double kByFar = 2.0;
    const auto& images = by_time_[camera];
    const auto next = images.lower_bound(stamp_ns);
    TimeNs nearest = std::numeric_limits<TimeNs>::max(), second = nearest;
    const RecordedImage* out = nullptr;
    const auto consider = [&](const auto& entry) {
      const TimeNs apart = std::abs(entry.first - stamp_ns);
      second = std::min(second, std::max(nearest, apart));
      if (apart < nearest) out = &entry.second;
      nearest = std::min(nearest, apart);
    };
    if (next != images.end()) consider(*next);
    if (next != images.begin()) consider(*std::prev(next));
    return nearest <= kMostCorrected && static_cast<double>(second) >= kByFar * static_cast<double>(nearest) ? out
                                                                                                             : nullptr;
  }

 private:
  static std::optional<std::size_t> camera_of(const camera::Rig& rig, std::size_t camera, const camera::Rig& recorded) {
    for (std::size_t c = 0; c < recorded.size(); ++c) {
      if (recorded.camera(c).name == rig.camera(camera).name) return c;
    }
    return rig.size() == recorded.size() ? std::optional(camera) : std::nullopt;
  }

  static void collect(const dataset::Dataset& data, std::size_t camera, std::map<TimeNs, RecordedImage>& images) {
    const TimeNs offset_ns = data.rig.camera(camera).time_offset_ns;
    for (const dataset::FrameEntry& frame : data.frames) {
      const auto& image = frame.images[camera];
      if (image) images[image->time_ns - offset_ns] = {&*image, camera};
    }
  }

  std::vector<std::map<TimeNs, RecordedImage>> by_time_;
};

// Whether an image of the recording was found for two images of the map, because these are of several recordings with
// the same time stamps.
bool any_twice(std::vector<const RecordedImage*> found) {
  std::erase(found, nullptr);
  std::ranges::sort(found);
  return std::ranges::adjacent_find(found) != found.end();
}

// How much of the keypoints of an image of the map the image of the recording shows (share_shown); nullopt if it cannot
// be read.
std::optional<double> shown(const map::BundledMap& map, const dataset::Dataset& data, const MapImage& image,
                            const RecordedImage& recorded) {
  const auto pixels = image_decoding::read_image(*recorded.image, format_of(data, recorded.camera));
  const camera::Camera& camera = map.rig().camera(image.camera);
  if (!pixels) return std::nullopt;
  if (pixels->width() != camera.width || pixels->height() != camera.height) return 0;
  return share_shown(*pixels, map.keypoints(image.keyframe, CameraIndex(image.camera)), map.pyramid());
}

// Whether a few of the images that were found, distributed over all, show their keyframes. Otherwise some are of
// another recording with the same time stamps.
bool sample_is_shown(const map::BundledMap& map, const dataset::Dataset* data, const std::vector<MapImage>& images,
                     const std::vector<const RecordedImage*>& found, const std::stop_token& stop) {
  constexpr std::size_t kSample = 12;
  std::vector<std::size_t> with_image;
  for (std::size_t i = 0; i < images.size(); ++i) {
    if (found[i]) with_image.push_back(i);
  }
  const std::size_t count = std::min(kSample, with_image.size());
  for (std::size_t k = 0; k < count && !stop.stop_requested(); ++k) {
    const std::size_t i = with_image[(2 * k + 1) * with_image.size() / (2 * count)];
    if (shown(map, *data, images[i], *found[i]).value_or(1) < kMostly) return false;
  }
  return true;
}

// If recordings have the same time stamps: keeps what was found for the images of the map which show most of the
// keypoints of their keyframes, and each image only for the keyframe of which it shows most.
void keep_shown(const map::BundledMap& map, const dataset::Dataset& data, const std::vector<MapImage>& images,
                std::vector<const RecordedImage*>& found, const std::stop_token& stop) {
  std::vector<double> share(images.size(), 0);
  std::map<const RecordedImage*, std::size_t> best;
  for (std::size_t i = 0; i < images.size() && !stop.stop_requested(); ++i) {
    if (!found[i]) continue;
    share[i] = shown(map, data, images[i], *found[i]).value_or(0);
    if (share[i] < kMostly) {
      found[i] = nullptr;
      continue;
    }
    const auto [other, first] = best.try_emplace(found[i], i);
    if (first) continue;
    const std::size_t worse = share[i] > share[other->second] ? std::exchange(other->second, i) : i;
    found[worse] = nullptr;
  }
}

// Adds numbers to names that occur several times, but not to those of images that are in the recording.
void make_unique(std::vector<MapImage>& images) {
  std::set<std::string> names;
  for (const bool recorded : {true, false}) {
    for (MapImage& image : images) {
      if (image.recorded.has_value() != recorded) continue;
      const std::filesystem::path path = image.name;
      for (int i = 2; !names.insert(image.name).second; ++i) {
        const std::string name = fmt::format("{}_{}{}", path.stem().string(), i, path.extension().string());
        image.name = (path.parent_path() / name).string();
      }
    }
  }
}

}  // namespace

ImageTable::ImageTable(const Selection& selection, const dataset::Dataset* data, const std::filesystem::path& root,
                       const std::stop_token& stop)
    : cameras_(selection.map->rig().size()), number_(selection.map->keyframe_slots() * cameras_, -1) {
  const camera::Rig& rig = selection.map->rig();
  const RecordedImages recorded(*selection.map, data);
  const std::vector<std::string> folders = folders_of(rig);
  std::vector<const RecordedImage*> found;
  for (const KeyframeId k : selection.keyframes) {
    const frame::BundledFrame& frame = *selection.map->keyframe(k).frame;
    const std::size_t first = images_.size();
    for (std::size_t c = 0; c < cameras_; ++c) {
      if (frame.cameras[c].state != image::ImageState::kPresent) continue;
      const TimeNs stamp_ns = frame.cameras[c].time_ns - rig.camera(c).time_offset_ns;
      number_[k.index() * cameras_ + c] = static_cast<int>(images_.size());
      images_.push_back({k, c, fmt::format("{}/{}.png", folders[c], stamp_ns), {}, {}});
      found.push_back(recorded.at(c, stamp_ns));
    }
    // One image with this stamp shows that this is the recording.
    const bool recorded_too = std::any_of(found.begin() + static_cast<std::ptrdiff_t>(first), found.end(),
                                          [](const RecordedImage* image) { return image != nullptr; });
    for (std::size_t i = first; recorded_too && i < found.size(); ++i) {
      const std::size_t c = images_[i].camera;
      if (!found[i]) found[i] = recorded.near(c, frame.cameras[c].time_ns - rig.camera(c).time_offset_ns);
    }
  }
  if (any_twice(found) || !sample_is_shown(*selection.map, data, images_, found, stop))
    keep_shown(*selection.map, *data, images_, found, stop);
  for (std::size_t i = 0; i < images_.size(); ++i) {
    if (!found[i]) continue;
    const std::filesystem::path& path = found[i]->image->path;
    const std::string file = path.empty() ? std::string() : path.lexically_relative(root).string();
    if (!file.empty()) images_[i].name = without_control_characters(file);
    images_[i].recorded = *found[i]->image;
    images_[i].format = format_of(*data, found[i]->camera);
    ++found_;
  }
  make_unique(images_);
}

void ImageTable::keep(const std::vector<std::uint8_t>& kept) {
  std::vector<MapImage> all = std::exchange(images_, {});
  std::ranges::fill(number_, -1);
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (!kept[i]) continue;
    number_[all[i].keyframe.index() * cameras_ + all[i].camera] = static_cast<int>(images_.size());
    images_.push_back(std::move(all[i]));
  }
}

void ImageTable::set_extensions(const std::string& extension) {
  for (MapImage& image : images_) image.name = below_folder(image.name).replace_extension(extension).string();
  make_unique(images_);
}

}  // namespace bslam::map_export
