#include "map_export/image_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

namespace bslam::map_export {
namespace {

struct RecordedImage {
  const image_files::ImageFile* image;
  std::size_t camera;  // of the recording
};

// The images of each camera of the map by their time stamps in ns. Cameras are recognised by their names, and, if a
// name is unknown and the numbers of cameras are equal, by their numbers.
class RecordedImages {
 public:
  RecordedImages(const camera::Rig& rig, const dataset::Dataset& data) : by_time_(rig.size()) {
    for (std::size_t c = 0; c < rig.size(); ++c) {
      const std::size_t recorded = camera_of(rig, c, data.rig);
      if (recorded < data.rig.size()) collect(data, recorded, by_time_[c]);
    }
  }

  const RecordedImage* at(std::size_t camera, TimeNs stamp_ns) const {
    constexpr TimeNs kRounding = 1000;  // a time offset that is not a whole number of nanoseconds
    const auto next = by_time_[camera].lower_bound(stamp_ns - kRounding);
    return next != by_time_[camera].end() && next->first <= stamp_ns + kRounding ? &next->second : nullptr;
  }

 private:
  static std::size_t camera_of(const camera::Rig& rig, std::size_t camera, const camera::Rig& recorded) {
    for (std::size_t c = 0; c < recorded.size(); ++c) {
      if (recorded.camera(c).name == rig.camera(camera).name) return c;
    }
    return rig.size() == recorded.size() ? camera : recorded.size();
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

}  // namespace

ImageTable::ImageTable(const Selection& selection, const dataset::Dataset* data, const std::filesystem::path& root)
    : cameras_(selection.map->rig().size()), number_(selection.map->keyframe_slots() * cameras_, -1) {
  const camera::Rig& rig = selection.map->rig();
  const std::optional<RecordedImages> recorded = data ? std::optional(RecordedImages(rig, *data)) : std::nullopt;
  for (const KeyframeId k : selection.keyframes) {
    const frame::BundledFrame& frame = *selection.map->keyframe(k).frame;
    for (std::size_t c = 0; c < cameras_; ++c) {
      if (frame.cameras[c].state != image::ImageState::kPresent) continue;
      const TimeNs stamp_ns = frame.cameras[c].time_ns - rig.camera(c).time_offset_ns;
      MapImage image{k, c, fmt::format("{}/{}.png", rig.camera(c).name, stamp_ns), {}, {}};
      const RecordedImage* found = recorded ? recorded->at(c, stamp_ns) : nullptr;
      if (found) {
        image.recorded = *found->image;
        const std::filesystem::path& path = found->image->path;
        if (!path.empty()) image.name = path.lexically_relative(root).string();
        if (found->camera < data->pixel_formats.size()) image.format = data->pixel_formats[found->camera];
        ++found_;
      }
      number_[k.index() * cameras_ + c] = static_cast<int>(images_.size());
      images_.push_back(std::move(image));
    }
  }
}

void ImageTable::set_extensions(const std::string& extension) {
  for (MapImage& image : images_) image.name = std::filesystem::path(image.name).replace_extension(extension).string();
}

}  // namespace bslam::map_export
