// Images of the cameras of a rig, taken together.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace bslam {

// One 8-bit grey image, row-major, raw as the camera delivers it: neither rectified nor undistorted.
struct CameraImage {
  const std::uint8_t* data = nullptr;  // first row; null = this camera has no image here
  int width = 0, height = 0;           // pixels, as the rig's camera says
  std::ptrdiff_t stride = 0;           // bytes from one row to the next, at least `width`
  std::int64_t time_ns = 0;  // middle of the exposure by the camera's own clock; the rig's time offset is added inside
  // Keeps `data` alive for as long as a copy of this struct exists. Empty: the memory is the caller's and has to stay
  // as it is until the call that was given the image returns.
  std::shared_ptr<const void> owner = nullptr;
};

// One image per camera of the rig, in the rig's order; any may be missing, not all.
struct ImageBundle {
  std::vector<CameraImage> images;
};

}  // namespace bslam
