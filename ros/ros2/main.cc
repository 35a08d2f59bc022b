// bslam_node of ROS 2. Parameters, topics and services: docs/ros.md.
#include <rclcpp/rclcpp.hpp>
#include <thread>

#include "bslam_node.h"

int main(int argc, char** argv) {
  rclcpp::init(argc, argv);
  const auto node = std::make_shared<rclcpp::Node>("bslam");
  auto ours = bslam_ros::BslamNode::create(node);
  if (!ours) {
    RCLCPP_FATAL(node->get_logger(), "%s", ours.error().message().c_str());
    rclcpp::shutdown();
    return 2;
  }
  rclcpp::executors::MultiThreadedExecutor executor;
  executor.add_node(node);
  std::thread spinner([&executor] { executor.spin(); });
  const bslam::Status started = (*ours)->start();
  if (!started) {
    RCLCPP_FATAL(node->get_logger(), "%s", started.error().message().c_str());
    rclcpp::shutdown();
  }
  spinner.join();  // until ROS is shut down
  const bslam::Status stopped = (*ours)->stop();
  if (!stopped) RCLCPP_ERROR(node->get_logger(), "%s", stopped.error().message().c_str());
  return !started ? 2 : stopped ? 0 : 1;
}
