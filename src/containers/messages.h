// The messages that recordings of cameras consist of, in the serialisations of ROS 1, ROS 2 (CDR) and Foxglove
// (protobuf).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/timestamp.h"
#include "containers/message_file.h"

namespace bslam::containers {

// sensor_msgs/Image, sensor_msgs/CompressedImage, foxglove.RawImage or foxglove.CompressedImage.
struct ImageMessage {
  TimeNs stamp_ns = 0;  // time stamp of its header; 0 if it was not set
  std::string frame_id;
  bool compressed = false;
  std::string encoding;  // encoding of the pixels, such as mono8; for a compressed image its format, such as jpeg
  std::uint32_t width = 0, height = 0;  // pixels; 0 for compressed images
  std::uint32_t step = 0;               // bytes from one row to the next
  bool big_endian = false;              // byte order of 16-bit values
  // Position of the pixels in the message, which may be truncated before them.
  std::uint64_t data_at = 0, data_size = 0;
};

// sensor_msgs/CameraInfo or foxglove.CameraCalibration.
struct CameraInfo {
  std::string frame_id;
  std::uint32_t width = 0, height = 0;
  std::string distortion_model;
  std::vector<double> distortion;
  std::array<double, 9> K{}, R{};  // 3x3, row-major
  std::array<double, 12> P{};      // 3x4, row-major
  std::uint32_t binning_x = 0, binning_y = 0;
  std::uint32_t roi_x = 0, roi_y = 0, roi_width = 0, roi_height = 0;
};

bool is_image_type(std::string_view type);
bool is_calibration_type(std::string_view type);

// Returns nullopt if the topic has another type or serialisation, or if the message is damaged or ends before the
// pixels (ROS) or the time stamp (protobuf). The message need not contain the pixels, unless it has no time stamp
// (protobuf).
std::optional<ImageMessage> parse_image(const Topic& topic, std::string_view message);

// Returns nullopt if the topic has another type or serialisation, or if the message is damaged.
std::optional<CameraInfo> parse_camera_info(const Topic& topic, std::string_view message);

// The same for one serialisation. Internal to this folder.
std::optional<ImageMessage> parse_ros_image(bool cdr, bool compressed, std::string_view message);
std::optional<CameraInfo> parse_ros_camera_info(bool cdr, std::string_view message);
std::optional<ImageMessage> parse_protobuf_image(bool compressed, std::string_view message);
std::optional<CameraInfo> parse_protobuf_calibration(std::string_view message);

}  // namespace bslam::containers
