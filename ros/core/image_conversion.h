// Images of ROS messages as the 8-bit grey images that bslam expects.
#pragma once

#include <bslam/bslam.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

namespace bslam_ros {

// Fields of sensor_msgs/Image; does not own the pixels.
struct RawImage {
  std::string encoding;  // of sensor_msgs/image_encodings: "mono8", "bgr8", "bayer_rggb8", "mono16", ...
  std::size_t width = 0, height = 0;
  std::size_t step = 0;  // bytes from row to row
  bool big_endian = false;
  const std::uint8_t* data = nullptr;
  std::size_t size = 0;               // bytes in `data`
  std::shared_ptr<const void> owner;  // keeps `data` alive; may be the message
};

// Converts to grey. 8-bit grey images are not copied, but keep `owner`. Colours are weighted as in ITU-R BT.601, and
// Bayer patterns are smoothed by a 3x3 binomial filter, which weighs red, green and blue by 1:2:1 everywhere. Of 16-bit
// images the upper 8 bits of `significant_bits` bits are used. Errors: an encoding that is not listed in docs/ros.md,
// an image without pixels, a step or size that is too small, a size beyond 20000 pixels.
bslam::Result<bslam::CameraImage> to_grey(const RawImage& image, std::int64_t time_ns, int significant_bits = 16);

}  // namespace bslam_ros
