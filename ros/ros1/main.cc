// bslam_node of ROS 1. Parameters, topics and services: docs/ros.md.
#include <ros/ros.h>

#include "bslam_node.h"

int main(int argc, char** argv) {
  ros::init(argc, argv, "bslam");
  ros::NodeHandle topics, own("~");
  auto node = bslam_ros::BslamNode::create(topics, own);
  if (!node) {
    ROS_FATAL_STREAM(node.error().message());
    return 2;
  }
  ros::AsyncSpinner spinner(0);  // a thread for each processor
  spinner.start();
  if (const bslam::Status started = (*node)->start(); !started) {
    ROS_FATAL_STREAM(started.error().message());
    return 2;
  }
  ros::waitForShutdown();
  const bslam::Status stopped = (*node)->stop();
  if (!stopped) std::cerr << "bslam: " << stopped.error().message() << '\n';
  return stopped ? 0 : 1;
}
