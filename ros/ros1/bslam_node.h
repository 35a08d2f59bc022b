// The ROS 1 node: topics, transforms and services around a SlamRunner.
#pragma once

#include <bslam_ros/LoadMap.h>
#include <bslam_ros/SaveMap.h>
#include <ros/ros.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>
#include <std_srvs/SetBool.h>
#include <tf2_ros/buffer.h>
#include <tf2_ros/static_transform_broadcaster.h>
#include <tf2_ros/transform_broadcaster.h>
#include <tf2_ros/transform_listener.h>

#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "core/camera_info.h"
#include "core/slam_runner.h"

namespace bslam_ros {

class BslamNode {
 public:
  // Reads the parameters. Errors: those of Parameters::check; a parameter of another type.
  static bslam::Result<std::unique_ptr<BslamNode>> create(ros::NodeHandle topics, ros::NodeHandle own);

  // Waits for the rig, then advertises, subscribes and returns. Errors: a wrong calibration, map or setting; the name
  // of a topic that ROS refuses. Returns without error if ROS is shut down meanwhile.
  bslam::Status start();

  // Ends the subscriptions and processes the images that have arrived.
  bslam::Status stop();

 private:
  BslamNode(ros::NodeHandle topics, ros::NodeHandle own, Parameters parameters);

  bslam::Status start_or_throw();
  bslam::Result<std::optional<bslam::Rig>> wait_for_rig();
  bslam::Result<std::optional<bslam::Rig>> rig_from_file();
  bslam::Result<std::optional<bslam::Rig>> rig_from_camera_info();
  std::optional<Pose> wait_for_transform(const std::string& child);
  Outputs outputs();
  void advertise();
  void subscribe();
  void on_image(std::size_t camera, const sensor_msgs::ImageConstPtr& message);
  void on_compressed(std::size_t camera, const sensor_msgs::CompressedImageConstPtr& message);
  void publish_camera_transform(std::size_t camera, const std::string& frame);
  void publish_pose(const PoseOutput& pose);
  void publish_transforms(const PoseOutput& pose);
  void publish_diagnostics(const std::vector<DiagnosticStatus>& statuses);
  bool save_map(SaveMap::Request& request, SaveMap::Response& response);
  bool load_map(LoadMap::Request& request, LoadMap::Response& response);
  bool localize_only(std_srvs::SetBool::Request& request, std_srvs::SetBool::Response& response);

  ros::NodeHandle topics_, own_;
  const Parameters parameters_;
  tf2_ros::Buffer tf_buffer_;
  tf2_ros::TransformListener tf_listener_;
  tf2_ros::TransformBroadcaster tf_;
  tf2_ros::StaticTransformBroadcaster static_tf_;
  ros::Publisher pose_, odometry_, path_, cloud_, diagnostics_;
  std::optional<bslam::Rig> rig_;
  std::vector<std::string> camera_frames_;  // whose static transforms are published
  std::mutex camera_frames_mutex_;
  std::unique_ptr<SlamRunner> runner_;
  std::vector<ros::Subscriber> subscribers_;
  std::vector<ros::ServiceServer> services_;
  ros::WallTimer diagnostics_timer_;
};

}  // namespace bslam_ros
