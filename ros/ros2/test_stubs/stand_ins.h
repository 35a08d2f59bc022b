// Declarations of what the ROS 2 node uses of rclcpp, tf2_ros and the messages, after their documentation (Humble), so
// that scripts/test_ros can compile the node on a computer without ROS 2. Nothing here is defined: the result cannot be
// linked or run, and only errors of C++ and of the names and types declared here are found.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace builtin_interfaces::msg {
struct Time {
  std::int32_t sec;
  std::uint32_t nanosec;
};
}  // namespace builtin_interfaces::msg

namespace std_msgs::msg {
struct Header {
  builtin_interfaces::msg::Time stamp;
  std::string frame_id;
};
}  // namespace std_msgs::msg

namespace geometry_msgs::msg {
struct Vector3 {
  double x, y, z;
};
using Point = Vector3;
struct Quaternion {
  double x, y, z, w;
};
struct Transform {
  Vector3 translation;
  Quaternion rotation;
};
struct TransformStamped {
  std_msgs::msg::Header header;
  std::string child_frame_id;
  Transform transform;
};
struct Pose {
  Point position;
  Quaternion orientation;
};
struct PoseStamped {
  std_msgs::msg::Header header;
  Pose pose;
};
struct PoseWithCovariance {
  Pose pose;
  std::array<double, 36> covariance;
};
struct PoseWithCovarianceStamped {
  std_msgs::msg::Header header;
  PoseWithCovariance pose;
};
struct Twist {
  Vector3 linear, angular;
};
struct TwistWithCovariance {
  Twist twist;
  std::array<double, 36> covariance;
};
}  // namespace geometry_msgs::msg

namespace nav_msgs::msg {
struct Odometry {
  std_msgs::msg::Header header;
  std::string child_frame_id;
  geometry_msgs::msg::PoseWithCovariance pose;
  geometry_msgs::msg::TwistWithCovariance twist;
};
struct Path {
  std_msgs::msg::Header header;
  std::vector<geometry_msgs::msg::PoseStamped> poses;
};
}  // namespace nav_msgs::msg

namespace sensor_msgs::msg {
struct PointField {
  static constexpr std::uint8_t FLOAT32 = 7;
  std::string name;
  std::uint32_t offset;
  std::uint8_t datatype;
  std::uint32_t count;
};
struct PointCloud2 {
  std_msgs::msg::Header header;
  std::uint32_t height, width;
  std::vector<PointField> fields;
  bool is_bigendian;
  std::uint32_t point_step, row_step;
  std::vector<std::uint8_t> data;
  bool is_dense;
};
struct Image {
  using ConstSharedPtr = std::shared_ptr<const Image>;
  std_msgs::msg::Header header;
  std::uint32_t height, width;
  std::string encoding;
  std::uint8_t is_bigendian;
  std::uint32_t step;
  std::vector<std::uint8_t> data;
};
struct CompressedImage {
  using ConstSharedPtr = std::shared_ptr<const CompressedImage>;
  std_msgs::msg::Header header;
  std::string format;
  std::vector<std::uint8_t> data;
};
struct RegionOfInterest {
  std::uint32_t x_offset, y_offset, height, width;
};
struct CameraInfo {
  using ConstSharedPtr = std::shared_ptr<const CameraInfo>;
  std_msgs::msg::Header header;
  std::uint32_t height, width;
  std::string distortion_model;
  std::vector<double> d;
  std::array<double, 9> k;
  std::uint32_t binning_x, binning_y;
  RegionOfInterest roi;
};
}  // namespace sensor_msgs::msg

namespace diagnostic_msgs::msg {
struct KeyValue {
  std::string key, value;
};
struct DiagnosticStatus {
  unsigned char level;
  std::string name, message, hardware_id;
  std::vector<KeyValue> values;
};
struct DiagnosticArray {
  std_msgs::msg::Header header;
  std::vector<DiagnosticStatus> status;
};
}  // namespace diagnostic_msgs::msg

namespace std_srvs::srv {
struct SetBool {
  struct Request {
    bool data;
  };
  struct Response {
    bool success;
    std::string message;
  };
};
}  // namespace std_srvs::srv

namespace bslam_ros::srv {
struct SaveMap {
  struct Request {
    std::string file;
  };
  using Response = std_srvs::srv::SetBool::Response;
};
struct LoadMap {
  struct Request {
    std::string file;
    bool localize_only;
  };
  using Response = std_srvs::srv::SetBool::Response;
};
}  // namespace bslam_ros::srv

namespace rclcpp {
struct Logger {};
struct Clock {
  using SharedPtr = std::shared_ptr<Clock>;
};
struct Time {
  operator builtin_interfaces::msg::Time() const;
};
enum class ReliabilityPolicy { Reliable, BestEffort };
enum class CallbackGroupType { MutuallyExclusive, Reentrant };
struct KeepLast {
  explicit KeepLast(std::size_t depth);
};
struct QoS {
  QoS(const KeepLast& history);  // NOLINT: implicit as in rclcpp
  QoS(std::size_t depth);        // NOLINT
  QoS& reliable();
  QoS& best_effort();
  ReliabilityPolicy reliability() const;
};
struct TopicEndpointInfo {
  const QoS& qos_profile() const;
};
struct CallbackGroup {
  using SharedPtr = std::shared_ptr<CallbackGroup>;
};
struct SubscriptionOptions {
  CallbackGroup::SharedPtr callback_group;
};
struct SubscriptionBase {
  using SharedPtr = std::shared_ptr<SubscriptionBase>;
};
template <class Message>
struct Subscription : SubscriptionBase {
  using SharedPtr = std::shared_ptr<Subscription>;
};
template <class Message>
struct Publisher {
  using SharedPtr = std::shared_ptr<Publisher>;
  void publish(const Message& message);
  std::size_t get_subscription_count() const;
};
template <class Type>
struct Service {
  using SharedPtr = std::shared_ptr<Service>;
};
struct TimerBase {
  using SharedPtr = std::shared_ptr<TimerBase>;
};

struct Node {
  using SharedPtr = std::shared_ptr<Node>;
  explicit Node(const std::string& name);
  template <class Value>
  Value declare_parameter(const std::string& name, const Value& value);
  template <class Message>
  typename Publisher<Message>::SharedPtr create_publisher(const std::string& topic, const QoS& qos);
  template <class Message>
  typename Subscription<Message>::SharedPtr create_subscription(
      const std::string& topic, const QoS& qos, std::function<void(const std::shared_ptr<const Message>&)> callback,
      const SubscriptionOptions& options = {});
  template <class Type>
  typename Service<Type>::SharedPtr create_service(
      const std::string& name,
      std::function<void(std::shared_ptr<typename Type::Request>, std::shared_ptr<typename Type::Response>)> callback);
  TimerBase::SharedPtr create_wall_timer(std::chrono::nanoseconds period, std::function<void()> callback);
  CallbackGroup::SharedPtr create_callback_group(CallbackGroupType type);
  std::vector<TopicEndpointInfo> get_publishers_info_by_topic(const std::string& topic) const;
  Logger get_logger() const;
  Clock::SharedPtr get_clock();
  Time now() const;
};

namespace executors {
struct MultiThreadedExecutor {
  void add_node(Node::SharedPtr node);
  void spin();
};
}  // namespace executors

void init(int argc, const char* const* argv);
bool ok();
bool shutdown();
}  // namespace rclcpp

inline void stand_in_log(const rclcpp::Logger&, const char* format, ...) __attribute__((format(printf, 2, 3)));
inline void stand_in_log(const rclcpp::Logger&, const char*, ...) {}
#define RCLCPP_INFO(logger, ...) stand_in_log(logger, __VA_ARGS__)
#define RCLCPP_WARN(logger, ...) stand_in_log(logger, __VA_ARGS__)
#define RCLCPP_ERROR(logger, ...) stand_in_log(logger, __VA_ARGS__)
#define RCLCPP_FATAL(logger, ...) stand_in_log(logger, __VA_ARGS__)
#define RCLCPP_WARN_THROTTLE(logger, clock, ms, ...) (static_cast<void>(clock), stand_in_log(logger, __VA_ARGS__))

namespace tf2 {
using TimePoint = std::chrono::time_point<std::chrono::system_clock, std::chrono::nanoseconds>;
const TimePoint TimePointZero{};
struct TransformException : std::runtime_error {
  using std::runtime_error::runtime_error;
};
}  // namespace tf2

namespace tf2_ros {
struct Buffer {
  explicit Buffer(rclcpp::Clock::SharedPtr clock);
  bool canTransform(const std::string& target, const std::string& source, const tf2::TimePoint& time,
                    std::string* error) const;
  geometry_msgs::msg::TransformStamped lookupTransform(const std::string& target, const std::string& source,
                                                       const tf2::TimePoint& time) const;
};
struct TransformListener {
  explicit TransformListener(Buffer& buffer);
};
struct TransformBroadcaster {
  explicit TransformBroadcaster(rclcpp::Node& node);
  void sendTransform(const std::vector<geometry_msgs::msg::TransformStamped>& transforms);
};
struct StaticTransformBroadcaster {
  explicit StaticTransformBroadcaster(rclcpp::Node& node);
  void sendTransform(const geometry_msgs::msg::TransformStamped& transform);
};
}  // namespace tf2_ros
