// Fills messages from outputs of the core. The messages of ROS 1 and ROS 2 have the same fields, so that each function
// is a template over the message; times are converted by set_stamp, which each node declares for its own.
#pragma once

#include <cstring>
#include <string>

#include "core/camera_info.h"
#include "core/image_conversion.h"
#include "core/outputs.h"
#include "core/parameters.h"

namespace bslam_ros {

template <class Message>
void fill_pose(const Pose& pose, Message& out) {
  out.position.x = pose.translation[0];
  out.position.y = pose.translation[1];
  out.position.z = pose.translation[2];
  out.orientation.x = pose.rotation[0];
  out.orientation.y = pose.rotation[1];
  out.orientation.z = pose.rotation[2];
  out.orientation.w = pose.rotation[3];
}

template <class Message>
void fill_transform(const Pose& T_parent_child, const std::string& parent, const std::string& child,
                    std::int64_t time_ns, Message& out) {
  set_stamp(time_ns, out.header.stamp);
  out.header.frame_id = parent;
  out.child_frame_id = child;
  out.transform.translation.x = T_parent_child.translation[0];
  out.transform.translation.y = T_parent_child.translation[1];
  out.transform.translation.z = T_parent_child.translation[2];
  out.transform.rotation.x = T_parent_child.rotation[0];
  out.transform.rotation.y = T_parent_child.rotation[1];
  out.transform.rotation.z = T_parent_child.rotation[2];
  out.transform.rotation.w = T_parent_child.rotation[3];
}

template <class Message>
Pose to_pose(const Message& transform) {
  Pose out;
  out.translation = {transform.translation.x, transform.translation.y, transform.translation.z};
  out.rotation = {transform.rotation.x, transform.rotation.y, transform.rotation.z, transform.rotation.w};
  return out;
}

template <class Array>
void fill_covariance(const RosCovariance& covariance, Array& out) {
  for (std::size_t i = 0; i < covariance.size(); ++i) out[i] = covariance[i];
}

// geometry_msgs/PoseWithCovarianceStamped, in the map frame.
template <class Message>
void fill_pose_message(const PoseOutput& pose, const Parameters& frames, Message& out) {
  set_stamp(pose.time_ns, out.header.stamp);
  out.header.frame_id = frames.map_frame;
  fill_pose(pose.T_map_base, out.pose.pose);
  fill_covariance(pose.covariance_map, out.pose.covariance);
}

// nav_msgs/Odometry: the odometry pose, and the velocity in the axes of base_link.
template <class Message>
void fill_odometry(const PoseOutput& pose, const Parameters& frames, Message& out) {
  set_stamp(pose.time_ns, out.header.stamp);
  out.header.frame_id = frames.odom_frame;
  out.child_frame_id = frames.base_frame;
  fill_pose(pose.T_odom_base, out.pose.pose);
  fill_covariance(pose.covariance_odom, out.pose.covariance);
  out.twist.twist.linear.x = pose.velocity.linear[0];
  out.twist.twist.linear.y = pose.velocity.linear[1];
  out.twist.twist.linear.z = pose.velocity.linear[2];
  out.twist.twist.angular.x = pose.velocity.angular[0];
  out.twist.twist.angular.y = pose.velocity.angular[1];
  out.twist.twist.angular.z = pose.velocity.angular[2];
  fill_covariance(unknown_covariance(), out.twist.covariance);
}

// nav_msgs/Path. The type of its poses is geometry_msgs/PoseStamped.
template <class Message>
void fill_path(const PathOutput& path, const Parameters& frames, Message& out) {
  set_stamp(path.time_ns, out.header.stamp);
  out.header.frame_id = frames.map_frame;
  out.poses.resize(path.poses.size());
  for (std::size_t i = 0; i < path.poses.size(); ++i) {
    set_stamp(path.poses[i].first, out.poses[i].header.stamp);
    out.poses[i].header.frame_id = frames.map_frame;
    fill_pose(path.poses[i].second, out.poses[i].pose);
  }
}

// sensor_msgs/PointCloud2 with the fields x, y, z and observations, 32-bit floats.
template <class Message>
void fill_cloud(const PointCloud& cloud, const Parameters& frames, Message& out) {
  using Field = typename decltype(out.fields)::value_type;
  using Point = PointCloud::Point;
  static_assert(sizeof(Point) == 16, "points are four floats without padding");
  set_stamp(cloud.time_ns, out.header.stamp);
  out.header.frame_id = frames.map_frame;
  out.fields.clear();
  std::uint32_t offset = 0;
  for (const char* name : {"x", "y", "z", "observations"}) {
    Field field;
    field.name = name;
    field.offset = offset;
    field.datatype = Field::FLOAT32;
    field.count = 1;
    out.fields.push_back(field);
    offset += static_cast<std::uint32_t>(sizeof(float));
  }
  const std::uint16_t one = 1;
  unsigned char first_byte = 0;
  std::memcpy(&first_byte, &one, 1);
  out.is_bigendian = first_byte == 0;
  out.height = 1;
  out.width = static_cast<std::uint32_t>(cloud.points.size());
  out.point_step = sizeof(Point);
  out.row_step = out.point_step * out.width;
  out.is_dense = true;
  out.data.resize(out.row_step);
  if (!cloud.points.empty()) std::memcpy(out.data.data(), cloud.points.data(), out.row_step);
}

// diagnostic_msgs/DiagnosticArray.
template <class Message>
void fill_diagnostics(const std::vector<DiagnosticStatus>& statuses, Message& out) {
  using Status = typename decltype(out.status)::value_type;
  using KeyValue = typename decltype(Status().values)::value_type;
  for (const DiagnosticStatus& status : statuses) {
    Status message;
    message.level = static_cast<decltype(message.level)>(status.level);
    message.name = status.name;
    message.message = status.message;
    message.hardware_id = "bslam";
    for (const auto& [key, value] : status.values) {
      KeyValue pair;
      pair.key = key;
      pair.value = value;
      message.values.push_back(pair);
    }
    out.status.push_back(message);
  }
}

// The image of a sensor_msgs/Image; `message` (a shared pointer) keeps its pixels alive.
template <class MessagePtr>
RawImage to_raw_image(const MessagePtr& message) {
  RawImage out;
  out.encoding = message->encoding;
  out.width = message->width;
  out.height = message->height;
  out.step = message->step;
  out.big_endian = message->is_bigendian != 0;
  out.data = message->data.data();
  out.size = message->data.size();
  out.owner = std::shared_ptr<const void>(message->data.data(), [message](const void*) {});
  return out;
}

// D and K are the fields d and k in ROS 2, so that they are passed.
template <class Message, class Distortion, class Matrix>
CameraInfo to_camera_info(const Message& message, const Distortion& D, const Matrix& K) {
  CameraInfo out;
  out.frame_id = message.header.frame_id;
  out.width = message.width;
  out.height = message.height;
  out.distortion_model = message.distortion_model;
  out.D.assign(D.begin(), D.end());
  for (std::size_t i = 0; i < out.K.size(); ++i) out.K[i] = K[i];
  out.binning_x = message.binning_x;
  out.binning_y = message.binning_y;
  out.roi_x = message.roi.x_offset;
  out.roi_y = message.roi.y_offset;
  out.roi_width = message.roi.width;
  out.roi_height = message.roi.height;
  return out;
}

}  // namespace bslam_ros
