#include "bslam_node.h"

#include <chrono>
#include <thread>
#include <utility>

#include "messages/compressed_image.h"
#include "ros_time.h"

// Uses set_stamp of ros_time.h.
#include "messages/fill_messages.h"

namespace bslam_ros {
namespace {

using std::chrono::steady_clock;

constexpr std::chrono::seconds kReminder{5};  // time between messages about what is waited for
constexpr std::chrono::milliseconds kPoll{50};

template <class Response>
void answer(const bslam::Status& status, Response& response) {
  response.success = status.ok();
  response.message = status ? "" : status.error().message();
}

// ROS 2 has no 32-bit integers among the types of its parameters.
template <class Value>
void read(rclcpp::Node& node, const std::string& name, Value& value) {
  value = node.declare_parameter<Value>(name, value);
}
void read(rclcpp::Node& node, const std::string& name, int& value) {
  value = static_cast<int>(node.declare_parameter<std::int64_t>(name, value));
}
void read(rclcpp::Node& node, const std::string& name, std::vector<int>& value) {
  using Numbers = std::vector<std::int64_t>;
  const Numbers numbers = node.declare_parameter<Numbers>(name, Numbers(value.begin(), value.end()));
  value.clear();
  for (const std::int64_t number : numbers) value.push_back(static_cast<int>(number));
}

}  // namespace

bslam::Result<std::unique_ptr<BslamNode>> BslamNode::create(rclcpp::Node::SharedPtr node) {
  Parameters parameters;
  try {
    Parameters::visit(parameters, [&](const char* name, auto& value, const char*) { read(*node, name, value); });
  } catch (const std::exception& error) {  // a value of another type, such as 1 where 1.0 is expected
    return bslam::Error{"parameters", "", "", "", error.what()};
  }
  if (const bslam::Status status = parameters.check(); !status) return status.error();
  return std::unique_ptr<BslamNode>(new BslamNode(std::move(node), std::move(parameters)));
}

BslamNode::BslamNode(rclcpp::Node::SharedPtr node, Parameters parameters)
    : node_(std::move(node)),
      parameters_(std::move(parameters)),
      tf_buffer_(node_->get_clock()),
      tf_listener_(tf_buffer_),
      tf_(*node_),
      static_tf_(*node_) {}

bslam::Status BslamNode::start() {
  try {
    return start_or_throw();
  } catch (const std::exception& error) {  // ROS refuses a name of a topic or a service by an exception
    return bslam::Error{"bslam_node", "", "", "", std::string("the node cannot start: ") + error.what()};
  }
}

bslam::Status BslamNode::start_or_throw() {
  auto rig = parameters_.rig.empty() ? rig_from_camera_info() : rig_from_file();
  if (!rig) return rig.error();
  if (!*rig) return {};
  rig_ = **rig;
  camera_frames_.resize(rig_->size());
  advertise();
  auto runner = SlamRunner::create(*rig_, parameters_, outputs());
  if (!runner) return runner.error();
  runner_ = *std::move(runner);
  offer_services();
  diagnostics_timer_ =
      node_->create_wall_timer(std::chrono::seconds(1), [this] { publish_diagnostics(runner_->diagnostics()); });
  subscribe();
  RCLCPP_INFO(node_->get_logger(), "ready: %zu cameras", rig_->size());
  return {};
}

bslam::Status BslamNode::stop() {
  subscriptions_.clear();
  diagnostics_timer_.reset();
  return runner_ ? runner_->stop() : bslam::Status();
}

bslam::Result<std::optional<bslam::Rig>> BslamNode::rig_from_file() {
  auto rig = parameters_.load_rig();
  if (!rig) return rig.error();
  for (const std::string& line : rig->notes()) RCLCPP_INFO(node_->get_logger(), "%s", line.c_str());
  for (const std::string& line : rig->warnings()) RCLCPP_WARN(node_->get_logger(), "%s", line.c_str());
  if (parameters_.body_frame.empty() || parameters_.body_frame == parameters_.base_frame) {
    if (body_has_optical_axes(*rig)) RCLCPP_WARN(node_->get_logger(), "%s", optical_axes_warning(parameters_).c_str());
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
    const std::optional<CameraInfo> info = wait_for_camera_info(parameters_.camera_info_topic(c));
    if (!info) return std::optional<bslam::Rig>();
    infos.push_back(*info);
    const std::optional<Pose> pose = wait_for_transform(info->frame_id);
    if (!pose) return std::optional<bslam::Rig>();
    T_base_cam.push_back(*pose);
  }
  auto rig = make_rig(infos, camera_names(parameters_), T_base_cam);
  if (!rig) return rig.error();
  for (const std::string& line : rig->warnings()) RCLCPP_WARN(node_->get_logger(), "%s", line.c_str());
  return std::optional<bslam::Rig>(*rig);
}

// Returns the first message of a topic; nullopt if ROS is shut down before it comes.
std::optional<CameraInfo> BslamNode::wait_for_camera_info(const std::string& topic) {
  struct Found {
    std::mutex mutex;
    std::optional<CameraInfo> info;
  };
  const auto found = std::make_shared<Found>();  // a callback may still run when this function has returned
  const auto subscription = node_->create_subscription<sensor_msgs::msg::CameraInfo>(
      topic, rclcpp::QoS(rclcpp::KeepLast(1)).best_effort(),
      [found](const sensor_msgs::msg::CameraInfo::ConstSharedPtr& message) {
        const std::lock_guard<std::mutex> lock(found->mutex);
        found->info = to_camera_info(*message, message->d, message->k);
      });
  auto told = steady_clock::now();
  while (rclcpp::ok()) {
    {
      const std::lock_guard<std::mutex> lock(found->mutex);
      if (found->info) return found->info;
    }
    if (steady_clock::now() - told > kReminder) {
      told = steady_clock::now();
      RCLCPP_WARN(node_->get_logger(), "waiting for a calibration on %s", topic.c_str());
    }
    std::this_thread::sleep_for(kPoll);
  }
  return std::nullopt;
}

// Returns T_base_child; nullopt if ROS is shut down before it is known.
std::optional<Pose> BslamNode::wait_for_transform(const std::string& child) {
  auto told = steady_clock::now();
  while (rclcpp::ok()) {
    std::string why;
    try {  // the one call may succeed and the other fail: the buffer is cleared when time jumps back
      if (tf_buffer_.canTransform(parameters_.base_frame, child, tf2::TimePointZero, &why))
        return to_pose(tf_buffer_.lookupTransform(parameters_.base_frame, child, tf2::TimePointZero).transform);
    } catch (const tf2::TransformException& error) {
      why = error.what();
    }
    if (steady_clock::now() - told > kReminder) {
      told = steady_clock::now();
      RCLCPP_WARN(node_->get_logger(), "waiting for the transform from %s to %s: %s", child.c_str(),
                  parameters_.base_frame.c_str(), why.c_str());
    }
    std::this_thread::sleep_for(kPoll);
  }
  return std::nullopt;
}

void BslamNode::advertise() {
  pose_ = node_->create_publisher<geometry_msgs::msg::PoseWithCovarianceStamped>("~/pose", 10);
  odometry_ = node_->create_publisher<nav_msgs::msg::Odometry>("~/odometry", 10);
  path_ = node_->create_publisher<nav_msgs::msg::Path>("~/path", 1);
  cloud_ = node_->create_publisher<sensor_msgs::msg::PointCloud2>("~/points", 1);
  diagnostics_ = node_->create_publisher<diagnostic_msgs::msg::DiagnosticArray>("/diagnostics", 10);
}

void BslamNode::offer_services() {
  save_map_ = node_->create_service<SaveMap>("~/save_map", [this](const std::shared_ptr<SaveMap::Request> request,
                                                                  std::shared_ptr<SaveMap::Response> response) {
    answer(runner_->save_map(request->file), *response);
  });
  load_map_ = node_->create_service<LoadMap>("~/load_map", [this](const std::shared_ptr<LoadMap::Request> request,
                                                                  std::shared_ptr<LoadMap::Response> response) {
    answer(runner_->load_map(request->file, request->localize_only), *response);
  });
  localize_only_ = node_->create_service<SetBool>(
      "~/localize_only",
      [this](const std::shared_ptr<SetBool::Request> request, std::shared_ptr<SetBool::Response> response) {
        answer(runner_->set_localize_only(request->data), *response);
      });
}

// Reliable delivery where all publishers offer it; best effort is compatible with every publisher.
rclcpp::QoS BslamNode::image_qos(const std::string& topic) const {
  std::vector<bool> reliable;
  for (const rclcpp::TopicEndpointInfo& publisher : node_->get_publishers_info_by_topic(topic))
    reliable.push_back(publisher.qos_profile().reliability() == rclcpp::ReliabilityPolicy::Reliable);
  rclcpp::QoS qos(rclcpp::KeepLast(static_cast<std::size_t>(parameters_.queue_size)));
  return subscribe_reliably(reliable) ? qos.reliable() : qos.best_effort();
}

void BslamNode::subscribe() {
  for (std::size_t c = 0; c < parameters_.image_topics.size(); ++c) {
    const std::string& topic = parameters_.image_topics[c];
    groups_.push_back(node_->create_callback_group(rclcpp::CallbackGroupType::MutuallyExclusive));
    rclcpp::SubscriptionOptions options;
    options.callback_group = groups_.back();
    if (is_compressed(topic)) {
      subscriptions_.push_back(node_->create_subscription<sensor_msgs::msg::CompressedImage>(
          topic, image_qos(topic),
          [this, c](const sensor_msgs::msg::CompressedImage::ConstSharedPtr& m) { on_compressed(c, m); }, options));
    } else {
      subscriptions_.push_back(node_->create_subscription<sensor_msgs::msg::Image>(
          topic, image_qos(topic), [this, c](const sensor_msgs::msg::Image::ConstSharedPtr& m) { on_image(c, m); },
          options));
    }
  }
}

Outputs BslamNode::outputs() {
  Outputs out;
  out.pose = [this](const PoseOutput& pose) { publish_pose(pose); };
  out.cloud = [this](const PointCloud& cloud) {
    sensor_msgs::msg::PointCloud2 message;
    fill_cloud(cloud, parameters_, message);
    cloud_->publish(message);
  };
  out.path = [this](const PathOutput& path) {
    nav_msgs::msg::Path message;
    fill_path(path, parameters_, message);
    path_->publish(message);
  };
  out.diagnostics = [this](const std::vector<DiagnosticStatus>& statuses) { publish_diagnostics(statuses); };
  out.cloud_subscribers = [this] { return cloud_->get_subscription_count(); };
  out.wants_path = [this] { return path_->get_subscription_count() > 0; };
  out.log = [this](bslam::LogLevel level, const std::string& line) {
    if (level == bslam::LogLevel::kWarning) {
      RCLCPP_WARN(node_->get_logger(), "%s", line.c_str());
    } else {
      RCLCPP_INFO(node_->get_logger(), "%s", line.c_str());
    }
  };
  return out;
}

void BslamNode::on_image(std::size_t camera, const sensor_msgs::msg::Image::ConstSharedPtr& message) {
  publish_camera_transform(camera, message->header.frame_id);
  const auto time_ns = stamp_ns(message->header.stamp);
  if (!time_ns) return runner_->reject(camera, time_ns.error());
  static_cast<void>(runner_->push(camera, to_raw_image(message), *time_ns));  // the runner reports errors
}

void BslamNode::on_compressed(std::size_t camera, const sensor_msgs::msg::CompressedImage::ConstSharedPtr& message) {
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
  geometry_msgs::msg::TransformStamped transform;
  fill_transform(rig_->camera(camera).T_body_cam, parameters_.base_frame, frame, 0, transform);
  transform.header.stamp = node_->now();
  static_tf_.sendTransform(transform);
}

void BslamNode::publish_pose(const PoseOutput& pose) {
  publish_transforms(pose);  // first, so that receivers of the others can transform them
  geometry_msgs::msg::PoseWithCovarianceStamped in_map;
  fill_pose_message(pose, parameters_, in_map);
  pose_->publish(in_map);
  nav_msgs::msg::Odometry odometry;
  fill_odometry(pose, parameters_, odometry);
  odometry_->publish(odometry);
}

void BslamNode::publish_transforms(const PoseOutput& pose) {
  if (!parameters_.publish_tf) return;
  std::vector<geometry_msgs::msg::TransformStamped> transforms(1);
  Pose T_map_odom = pose.T_map_odom;
  if (parameters_.publish_odom_tf) {
    transforms.emplace_back();
    fill_transform(pose.T_odom_base, parameters_.odom_frame, parameters_.base_frame, pose.time_ns, transforms[1]);
  } else {
    try {
      const auto odom = tf_buffer_.lookupTransform(parameters_.odom_frame, parameters_.base_frame,
                                                   tf2::TimePoint(std::chrono::nanoseconds(pose.time_ns)));
      T_map_odom = map_from_odom(pose.T_map_base, to_pose(odom.transform));
    } catch (const tf2::TransformException& error) {
      RCLCPP_WARN_THROTTLE(node_->get_logger(), *node_->get_clock(), 5000, "no transform %s -> %s: %s",
                           parameters_.map_frame.c_str(), parameters_.odom_frame.c_str(), error.what());
      return;
    }
  }
  fill_transform(T_map_odom, parameters_.map_frame, parameters_.odom_frame, pose.time_ns, transforms[0]);
  tf_.sendTransform(transforms);
}

void BslamNode::publish_diagnostics(const std::vector<DiagnosticStatus>& statuses) {
  diagnostic_msgs::msg::DiagnosticArray message;
  message.header.stamp = node_->now();
  fill_diagnostics(statuses, message);
  diagnostics_->publish(message);
}

}  // namespace bslam_ros
