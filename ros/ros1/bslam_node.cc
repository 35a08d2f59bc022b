#include "bslam_node.h"

#include <diagnostic_msgs/DiagnosticArray.h>
#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <geometry_msgs/TransformStamped.h>
#include <nav_msgs/Odometry.h>
#include <nav_msgs/Path.h>
#include <sensor_msgs/PointCloud2.h>

#include <utility>

#include "messages/compressed_image.h"
#include "ros_time.h"

// Uses set_stamp of ros_time.h.
#include "messages/fill_messages.h"

namespace bslam_ros {
namespace {

constexpr double kReminder_s = 5;  // time between messages about what is waited for

void write_log(bslam::LogLevel level, const std::string& line) {
  if (level == bslam::LogLevel::kWarning) {
    ROS_WARN_STREAM(line);
  } else {
    ROS_INFO_STREAM(line);
  }
}

template <class Response>
bool answer(const bslam::Status& status, Response& response) {
  response.success = status.ok();
  response.message = status ? "" : status.error().message();
  return true;  // the call itself has succeeded
}

}  // namespace

bslam::Result<std::unique_ptr<BslamNode>> BslamNode::create(ros::NodeHandle topics, ros::NodeHandle own) {
  Parameters parameters;
  std::string mistyped;
  Parameters::visit(parameters, [&](const char* name, auto& value, const char*) {
    if (own.hasParam(name) && !own.getParam(name, value)) mistyped = name;
  });
  if (!mistyped.empty())
    return bslam::Error{"parameter", mistyped, "a value of another type",
                        "one as in docs/ros.md; lists are set by a launch file or rosparam, not on the command line"};
  if (const bslam::Status status = parameters.check(); !status) return status.error();
  return std::unique_ptr<BslamNode>(new BslamNode(topics, own, parameters));
}

BslamNode::BslamNode(ros::NodeHandle topics, ros::NodeHandle own, Parameters parameters)
    : topics_(topics), own_(own), parameters_(std::move(parameters)), tf_listener_(tf_buffer_) {}

bslam::Status BslamNode::start() {
  try {
    return start_or_throw();
  } catch (const std::exception& error) {  // ROS refuses a name of a topic or a service by an exception
    return bslam::Error{"bslam_node", "", "", "", std::string("the node cannot start: ") + error.what()};
  }
}

bslam::Status BslamNode::start_or_throw() {
  auto rig = wait_for_rig();
  if (!rig) return rig.error();
  if (!*rig) return {};
  rig_ = **rig;
  camera_frames_.resize(rig_->size());
  advertise();
  auto runner = SlamRunner::create(*rig_, parameters_, outputs());
  if (!runner) return runner.error();
  runner_ = *std::move(runner);
  services_ = {own_.advertiseService("save_map", &BslamNode::save_map, this),
               own_.advertiseService("load_map", &BslamNode::load_map, this),
               own_.advertiseService("localize_only", &BslamNode::localize_only, this)};
  diagnostics_timer_ = own_.createWallTimer(
      ros::WallDuration(1.0), [this](const ros::WallTimerEvent&) { publish_diagnostics(runner_->diagnostics()); });
  subscribe();
  ROS_INFO_STREAM("ready: " << rig_->size() << " cameras");
  return {};
}

bslam::Status BslamNode::stop() {
  for (ros::Subscriber& subscriber : subscribers_) subscriber.shutdown();
  diagnostics_timer_.stop();
  return runner_ ? runner_->stop() : bslam::Status();
}

bslam::Result<std::optional<bslam::Rig>> BslamNode::wait_for_rig() {
  return parameters_.rig.empty() ? rig_from_camera_info() : rig_from_file();
}

bslam::Result<std::optional<bslam::Rig>> BslamNode::rig_from_file() {
  auto rig = parameters_.load_rig();
  if (!rig) return rig.error();
  for (const std::string& line : rig->notes()) ROS_INFO_STREAM(line);
  for (const std::string& line : rig->warnings()) ROS_WARN_STREAM(line);
  if (parameters_.body_frame.empty() || parameters_.body_frame == parameters_.base_frame) {
    if (body_has_optical_axes(*rig)) ROS_WARN_STREAM(optical_axes_warning(parameters_));
    return std::optional<bslam::Rig>(*rig);
  }
  const std::optional<Pose> T_base_body = wait_for_transform(parameters_.body_frame);
  if (!T_base_body) return std::optional<bslam::Rig>();
  auto moved = with_base_as_body(*rig, *T_base_body);
  if (!moved) return moved.error();
  return std::optional<bslam::Rig>(*moved);
}

bslam::Result<std::optional<bslam::Rig>> BslamNode::rig_from_camera_info() {
  std::vector<CameraInfo> infos;
  std::vector<Pose> T_base_cam;
  for (std::size_t c = 0; c < parameters_.image_topics.size(); ++c) {
    const std::string topic = parameters_.camera_info_topic(c);
    sensor_msgs::CameraInfoConstPtr message;
    while (!message && ros::ok()) {
      message = ros::topic::waitForMessage<sensor_msgs::CameraInfo>(topic, topics_, ros::Duration(kReminder_s));
      if (!message) ROS_WARN_STREAM("waiting for the calibration of camera " << c << " on " << topic);
    }
    if (!message) return std::optional<bslam::Rig>();
    infos.push_back(to_camera_info(*message, message->D, message->K));
    const std::optional<Pose> pose = wait_for_transform(infos.back().frame_id);
    if (!pose) return std::optional<bslam::Rig>();
    T_base_cam.push_back(*pose);
  }
  auto rig = make_rig(infos, camera_names(parameters_), T_base_cam);
  if (!rig) return rig.error();
  for (const std::string& line : rig->warnings()) ROS_WARN_STREAM(line);
  return std::optional<bslam::Rig>(*rig);
}

// Returns T_base_child; nullopt if ROS is shut down before it is known.
std::optional<Pose> BslamNode::wait_for_transform(const std::string& child) {
  ros::WallTime told = ros::WallTime::now();
  while (ros::ok()) {
    std::string why;
    try {  // the one call may succeed and the other fail: the buffer is cleared when time jumps back
      if (tf_buffer_.canTransform(parameters_.base_frame, child, ros::Time(0), &why))
        return to_pose(tf_buffer_.lookupTransform(parameters_.base_frame, child, ros::Time(0)).transform);
    } catch (const tf2::TransformException& error) {
      why = error.what();
    }
    if ((ros::WallTime::now() - told).toSec() > kReminder_s) {
      told = ros::WallTime::now();
      ROS_WARN_STREAM("waiting for the transform from " << child << " to " << parameters_.base_frame << ": " << why);
    }
    ros::WallDuration(0.05).sleep();  // tf arrives in a thread of the listener
  }
  return std::nullopt;
}

void BslamNode::advertise() {
  pose_ = own_.advertise<geometry_msgs::PoseWithCovarianceStamped>("pose", 10);
  odometry_ = own_.advertise<nav_msgs::Odometry>("odometry", 10);
  path_ = own_.advertise<nav_msgs::Path>("path", 1);
  cloud_ = own_.advertise<sensor_msgs::PointCloud2>("points", 1);
  diagnostics_ = topics_.advertise<diagnostic_msgs::DiagnosticArray>("/diagnostics", 10);
}

void BslamNode::subscribe() {
  const auto queue = static_cast<std::uint32_t>(parameters_.queue_size);
  const ros::TransportHints hints = ros::TransportHints().tcpNoDelay();
  for (std::size_t c = 0; c < parameters_.image_topics.size(); ++c) {
    const std::string& topic = parameters_.image_topics[c];
    if (is_compressed(topic)) {
      subscribers_.push_back(topics_.subscribe<sensor_msgs::CompressedImage>(
          topic, queue, [this, c](const sensor_msgs::CompressedImageConstPtr& m) { on_compressed(c, m); },
          ros::VoidConstPtr(), hints));
    } else {
      subscribers_.push_back(topics_.subscribe<sensor_msgs::Image>(
          topic, queue, [this, c](const sensor_msgs::ImageConstPtr& m) { on_image(c, m); }, ros::VoidConstPtr(),
          hints));
    }
  }
}

Outputs BslamNode::outputs() {
  Outputs out;
  out.pose = [this](const PoseOutput& pose) { publish_pose(pose); };
  out.cloud = [this](const PointCloud& cloud) {
    sensor_msgs::PointCloud2 message;
    fill_cloud(cloud, parameters_, message);
    cloud_.publish(message);
  };
  out.path = [this](const PathOutput& path) {
    nav_msgs::Path message;
    fill_path(path, parameters_, message);
    path_.publish(message);
  };
  out.diagnostics = [this](const std::vector<DiagnosticStatus>& statuses) { publish_diagnostics(statuses); };
  out.cloud_subscribers = [this] { return cloud_.getNumSubscribers(); };
  out.wants_path = [this] { return path_.getNumSubscribers() > 0; };
  out.log = write_log;
  return out;
}

void BslamNode::on_image(std::size_t camera, const sensor_msgs::ImageConstPtr& message) {
  publish_camera_transform(camera, message->header.frame_id);
  const auto time_ns = stamp_ns(message->header.stamp);
  if (!time_ns) return runner_->reject(camera, time_ns.error());
  static_cast<void>(runner_->push(camera, to_raw_image(message), *time_ns));  // the runner reports errors
}

void BslamNode::on_compressed(std::size_t camera, const sensor_msgs::CompressedImageConstPtr& message) {
  publish_camera_transform(camera, message->header.frame_id);
  const auto time_ns = stamp_ns(message->header.stamp);
  if (!time_ns) return runner_->reject(camera, time_ns.error());
  const auto image = decode(message->data, message->format);
  if (!image) return runner_->reject(camera, image.error());
  static_cast<void>(runner_->push(camera, *image, *time_ns));
}

// With the first image of a camera, whose header names its frame.
void BslamNode::publish_camera_transform(std::size_t camera, const std::string& frame) {
  if (!parameters_.publish_camera_tf || frame.empty()) return;
  const std::lock_guard<std::mutex> lock(camera_frames_mutex_);
  if (!camera_frames_[camera].empty()) return;
  camera_frames_[camera] = frame;
  geometry_msgs::TransformStamped transform;
  fill_transform(rig_->camera(camera).T_body_cam, parameters_.base_frame, frame, 0, transform);
  transform.header.stamp = ros::Time::now();
  static_tf_.sendTransform(transform);
}

void BslamNode::publish_pose(const PoseOutput& pose) {
  publish_transforms(pose);  // first, so that receivers of the others can transform them
  geometry_msgs::PoseWithCovarianceStamped in_map;
  fill_pose_message(pose, parameters_, in_map);
  pose_.publish(in_map);
  nav_msgs::Odometry odometry;
  fill_odometry(pose, parameters_, odometry);
  odometry_.publish(odometry);
}

void BslamNode::publish_transforms(const PoseOutput& pose) {
  if (!parameters_.publish_tf) return;
  std::vector<geometry_msgs::TransformStamped> transforms(1);
  Pose T_map_odom = pose.T_map_odom;
  if (parameters_.publish_odom_tf) {
    transforms.emplace_back();
    fill_transform(pose.T_odom_base, parameters_.odom_frame, parameters_.base_frame, pose.time_ns, transforms[1]);
  } else {
    ros::Time stamp;
    set_stamp(pose.time_ns, stamp);
    try {
      const auto odom = tf_buffer_.lookupTransform(parameters_.odom_frame, parameters_.base_frame, stamp);
      T_map_odom = map_from_odom(pose.T_map_base, to_pose(odom.transform));
    } catch (const tf2::TransformException& error) {
      ROS_WARN_STREAM_THROTTLE(
          5, "no transform " << parameters_.map_frame << " -> " << parameters_.odom_frame << ": " << error.what());
      return;
    }
  }
  fill_transform(T_map_odom, parameters_.map_frame, parameters_.odom_frame, pose.time_ns, transforms[0]);
  tf_.sendTransform(transforms);
}

void BslamNode::publish_diagnostics(const std::vector<DiagnosticStatus>& statuses) {
  diagnostic_msgs::DiagnosticArray message;
  message.header.stamp = ros::Time::now();
  fill_diagnostics(statuses, message);
  diagnostics_.publish(message);
}

bool BslamNode::save_map(SaveMap::Request& request, SaveMap::Response& response) {
  return answer(runner_->save_map(request.file), response);
}

bool BslamNode::load_map(LoadMap::Request& request, LoadMap::Response& response) {
  return answer(runner_->load_map(request.file, request.localize_only), response);
}

bool BslamNode::localize_only(std_srvs::SetBool::Request& request, std_srvs::SetBool::Response& response) {
  return answer(runner_->set_localize_only(request.data), response);
}

}  // namespace bslam_ros
