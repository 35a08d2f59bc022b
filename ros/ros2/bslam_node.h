// The ROS 2 node: topics, transforms and services around a SlamRunner.
#pragma once

#include <tf2_ros/buffer.h>
#include <tf2_ros/static_transform_broadcaster.h>
#include <tf2_ros/transform_broadcaster.h>
#include <tf2_ros/transform_listener.h>

#include <bslam_ros/srv/load_map.hpp>
#include <bslam_ros/srv/save_map.hpp>
#include <diagnostic_msgs/msg/diagnostic_array.hpp>
#include <geometry_msgs/msg/pose_with_covariance_stamped.hpp>
#include <geometry_msgs/msg/transform_stamped.hpp>
#include <memory>
#include <mutex>
#include <nav_msgs/msg/odometry.hpp>
#include <nav_msgs/msg/path.hpp>
#include <optional>
#include <rclcpp/rclcpp.hpp>
#include <sensor_msgs/msg/camera_info.hpp>
#include <sensor_msgs/msg/compressed_image.hpp>
#include <sensor_msgs/msg/image.hpp>
#include <sensor_msgs/msg/point_cloud2.hpp>
#include <std_srvs/srv/set_bool.hpp>
#include <string>
#include <vector>

#include "core/camera_info.h"
#include "core/slam_runner.h"

namespace bslam_ros {

class BslamNode {
 public:
  // Declares and reads the parameters. Errors: those of Parameters::check; a parameter of another type.
  static bslam::Result<std::unique_ptr<BslamNode>> create(rclcpp::Node::SharedPtr node);

  // Waits for the rig, then advertises, subscribes and returns; an executor must spin meanwhile. Errors: a wrong
  // calibration, map or setting; the name of a topic that ROS refuses. Returns without error if ROS is shut down
  // meanwhile.
  bslam::Status start();

  // Ends the subscriptions and processes the images that have arrived.
  bslam::Status stop();

 private:
  using SaveMap = bslam_ros::srv::SaveMap;
  using LoadMap = bslam_ros::srv::LoadMap;
  using SetBool = std_srvs::srv::SetBool;

  BslamNode(rclcpp::Node::SharedPtr node, Parameters parameters);

  bslam::Status start_or_throw();
  bslam::Result<std::optional<bslam::Rig>> rig_from_file();
  bslam::Result<std::optional<bslam::Rig>> rig_from_camera_info();
  std::optional<CameraInfo> wait_for_camera_info(const std::string& topic);
  std::optional<Pose> wait_for_transform(const std::string& child);
  rclcpp::QoS image_qos(const std::string& topic) const;
  Outputs outputs();
  void advertise();
  void offer_services();
  void subscribe();
  void on_image(std::size_t camera, const sensor_msgs::msg::Image::ConstSharedPtr& message);
  void on_compressed(std::size_t camera, const sensor_msgs::msg::CompressedImage::ConstSharedPtr& message);
  void publish_camera_transform(std::size_t camera, const std::string& frame);
  void publish_pose(const PoseOutput& pose);
  void publish_transforms(const PoseOutput& pose);
  void publish_diagnostics(const std::vector<DiagnosticStatus>& statuses);

  const rclcpp::Node::SharedPtr node_;
  const Parameters parameters_;
  tf2_ros::Buffer tf_buffer_;
  tf2_ros::TransformListener tf_listener_;
  tf2_ros::TransformBroadcaster tf_;
  tf2_ros::StaticTransformBroadcaster static_tf_;
  rclcpp::Publisher<geometry_msgs::msg::PoseWithCovarianceStamped>::SharedPtr pose_;
  rclcpp::Publisher<nav_msgs::msg::Odometry>::SharedPtr odometry_;
  rclcpp::Publisher<nav_msgs::msg::Path>::SharedPtr path_;
  rclcpp::Publisher<sensor_msgs::msg::PointCloud2>::SharedPtr cloud_;
  rclcpp::Publisher<diagnostic_msgs::msg::DiagnosticArray>::SharedPtr diagnostics_;
  std::optional<bslam::Rig> rig_;
  std::vector<std::string> camera_frames_;  // whose static transforms are published
  std::mutex camera_frames_mutex_;
  std::unique_ptr<SlamRunner> runner_;
  std::vector<rclcpp::CallbackGroup::SharedPtr> groups_;  // one per camera: cameras in parallel, images in order
  std::vector<rclcpp::SubscriptionBase::SharedPtr> subscriptions_;
  rclcpp::Service<SaveMap>::SharedPtr save_map_;
  rclcpp::Service<LoadMap>::SharedPtr load_map_;
  rclcpp::Service<SetBool>::SharedPtr localize_only_;
  rclcpp::TimerBase::SharedPtr diagnostics_timer_;
};

}  // namespace bslam_ros
