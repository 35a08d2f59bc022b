// bslam_node of ROS 2. Parameters, topics and services: docs/ros.md.
#include <rclcpp/rclcpp.hpp>
#include <thread>

#include "bslam_node.h"

namespace {

// Calls the callbacks of a node in a thread that ends with ROS, at the latest when this object is destroyed.
class Spinner {
 public:
  explicit Spinner(const rclcpp::Node::SharedPtr& node) {
    executor_.add_node(node);
    thread_ = std::thread([this, logger = node->get_logger()] {
      try {
        executor_.spin();
      } catch (const std::exception& error) {
        RCLCPP_FATAL(logger, "bslam_node: %s", error.what());
        failed_ = true;
        rclcpp::shutdown();
      }
    });
  }
  ~Spinner() {
    rclcpp::shutdown();
    if (thread_.joinable()) thread_.join();
  }
  Spinner(const Spinner&) = delete;
  Spinner& operator=(const Spinner&) = delete;

  // Returns when ROS is shut down; false after an exception of a callback.
  bool wait() {
    thread_.join();
    return !failed_;
  }

 private:
  rclcpp::executors::MultiThreadedExecutor executor_;
  bool failed_ = false;
  std::thread thread_;
};

}  // namespace

int main(int argc, char** argv) {
  rclcpp::init(argc, argv);
  const auto node = std::make_shared<rclcpp::Node>("bslam");
  auto ours = bslam_ros::BslamNode::create(node);
  if (!ours) {
    RCLCPP_FATAL(node->get_logger(), "%s", ours.error().message().c_str());
    rclcpp::shutdown();
    return 2;
  }
  Spinner spinner(node);
  const bslam::Status started = (*ours)->start();
  if (!started) {
    RCLCPP_FATAL(node->get_logger(), "%s", started.error().message().c_str());
    rclcpp::shutdown();
  }
  const bool spun = spinner.wait();
  const bslam::Status stopped = (*ours)->stop();
  if (!stopped) RCLCPP_ERROR(node->get_logger(), "%s", stopped.error().message().c_str());
  return !started ? 2 : stopped && spun ? 0 : 1;
}
