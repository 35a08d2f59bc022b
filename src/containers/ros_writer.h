// Writes ROS 2 messages of cameras (CDR, little-endian), which messages.h reads.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "base/timestamp.h"

namespace bslam::containers {

// sensor_msgs/msg/Image of 8-bit grey values: `height` rows of `width` bytes, `stride` bytes apart.
std::string grey_image_message(TimeNs stamp_ns, std::string_view frame_id, int width, int height,
                               const std::uint8_t* data, std::ptrdiff_t stride);

// sensor_msgs/msg/CompressedImage of a whole JPEG file.
std::string jpeg_image_message(TimeNs stamp_ns, std::string_view frame_id, std::string_view file);

// The types with their definitions, by which other programs understand the messages.
constexpr const char* kImageType = "sensor_msgs/msg/Image";
constexpr const char* kCompressedImageType = "sensor_msgs/msg/CompressedImage";
std::string image_definition();
std::string compressed_image_definition();

}  // namespace bslam::containers
