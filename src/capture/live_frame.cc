#include "capture/live_frame.h"

#include <algorithm>
#include <optional>

namespace bslam::capture {

const CapturedPixels& pixels_of(const CameraImage& image) {
  return *static_cast<const CapturedPixels*>(image.owner.get());
}

TimeNs time_of(const ImageBundle& bundle, const camera::Rig& rig) {
  std::optional<TimeNs> earliest;
  for (std::size_t c = 0; c < bundle.images.size(); ++c) {
    if (bundle.images[c].data == nullptr) continue;
    const TimeNs time_ns = bundle.images[c].time_ns + rig.camera(c).time_offset_ns;
    if (c == 0) return time_ns;
    earliest = std::min(earliest.value_or(time_ns), time_ns);
  }
  return earliest.value_or(0);
}

image::ImageBundle frame_of(const ImageBundle& bundle, const camera::Rig& rig, FrameId id) {
  image::ImageBundle out{id, time_of(bundle, rig), std::vector<image::CameraImage>(bundle.images.size())};
  for (std::size_t c = 0; c < bundle.images.size(); ++c) {
    const CameraImage& image = bundle.images[c];
    if (image.data == nullptr) continue;
    out.images[c].state = image::ImageState::kPresent;
    out.images[c].time_ns = image.time_ns + rig.camera(c).time_offset_ns;
    out.images[c].image = image::copy_of({image.data, image.width, image.height, image.stride});
  }
  return out;
}

}  // namespace bslam::capture
