// Images of the cameras of a rig taken at the same time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace bslam {

// An 8-bit grey image, row-major, as delivered by the camera: neither rectified nor undistorted.
struct CameraImage {
  const std::uint8_t* data = nullptr;  // first row; null if the camera has no image
  int width = 0, height = 0;           // pixels; must equal the resolution of the calibration
  std::ptrdiff_t stride = 0;           // bytes between rows; must be at least `width`
  // Middle of the exposure by the clock of the camera; the library adds the time offset of the calibration.
  std::int64_t time_ns = 0;
  // Owner of `data` and `mask`, which keeps them alive as long as a copy of this struct exists. If empty, the memory
  // belongs to the caller and must remain valid and unchanged until the call that receives the image returns.
  std::shared_ptr<const void> owner = nullptr;
  // Pixels to ignore, where the mask is 0, such as moving people, in addition to those of the camera's mask; of the
  // same width and height as the image. Null if the image has no mask.
  const std::uint8_t* mask = nullptr;
  std::ptrdiff_t mask_stride = 0;  // bytes between its rows; must be at least `width` if there is a mask
};

// One image per camera of the rig, in the order of the rig. Any image may be missing, but not all.
struct ImageBundle {
  std::vector<CameraImage> images;
};

}  // namespace bslam
