#include "containers/messages.h"

namespace bslam::containers {

bool is_image_type(std::string_view type) { return is_needed(type) && !is_calibration_type(type); }

bool is_calibration_type(std::string_view type) {
  return type == "sensor_msgs/CameraInfo" || type == "foxglove/CameraCalibration";
}

std::optional<ImageMessage> parse_image(const Topic& topic, std::string_view message) {
  if (!is_image_type(topic.type)) return std::nullopt;
  const bool ros = topic.type.starts_with("sensor_msgs/"), compressed = topic.type.ends_with("CompressedImage");
  if (ros && (topic.parsed_as == Serialisation::kRos1 || topic.parsed_as == Serialisation::kCdr))
    return parse_ros_image(topic.parsed_as == Serialisation::kCdr, compressed, message);
  if (!ros && topic.parsed_as == Serialisation::kProtobuf) return parse_protobuf_image(compressed, message);
  return std::nullopt;
}

std::optional<CameraInfo> parse_camera_info(const Topic& topic, std::string_view message) {
  if (topic.type == "sensor_msgs/CameraInfo" &&
      (topic.parsed_as == Serialisation::kRos1 || topic.parsed_as == Serialisation::kCdr))
    return parse_ros_camera_info(topic.parsed_as == Serialisation::kCdr, message);
  if (topic.type == "foxglove/CameraCalibration" && topic.parsed_as == Serialisation::kProtobuf)
    return parse_protobuf_calibration(message);
  return std::nullopt;
}

}  // namespace bslam::containers
