// The parameters of the nodes, the same for ROS 1 and ROS 2.
#pragma once

#include <bslam/bslam.h>

#include <string>
#include <vector>

namespace bslam_ros {

struct Parameters {
  std::vector<std::string> image_topics;
  std::vector<std::string> camera_info_topics;
  std::string rig;
  std::vector<int> cameras;
  std::string config;
  std::vector<std::string> settings;
  std::string map_file;
  std::string trajectory_file;
  std::string map_frame = "map";
  std::string odom_frame = "odom";
  std::string base_frame = "base_link";
  std::string body_frame;
  bool publish_tf = true;
  bool publish_odom_tf = true;
  bool publish_camera_tf = false;
  double sync_tolerance = 0.002;
  double max_wait = 0.1;
  int max_bundles = 8;
  int queue_size = 20;
  int significant_bits = 16;
  double cloud_period = 1.0;
  int cloud_min_observations = 3;
  double path_period = 1.0;
  int path_max_poses = 2000;
  int history_frames = 20000;

  // Calls visit(name, value, help) for every parameter. `visit` may change the value.
  template <class Self, class Visit>
  static void visit(Self& self, Visit&& visit) {
    visit("image_topics", self.image_topics,
          "image topics in the order of the cameras; topics that end in /compressed carry compressed images");
    visit("camera_info_topics", self.camera_info_topics,
          "topics of the calibrations, used without `rig`; default: camera_info beside each image topic");
    visit("rig", self.rig, "calibration file in any format of bslam; empty: from CameraInfo and tf");
    visit("cameras", self.cameras,
          "indices, from 0, of the cameras of the rig file that the image topics belong to, in their order; default: "
          "all");
    visit("config", self.config, "settings of bslam, a YAML file as `bslam run` writes it");
    visit("settings", self.settings, "further settings of bslam, each `name=value`");
    visit("map_file", self.map_file, "saved map to continue, or to localise in; empty: a new map");
    visit("trajectory_file", self.trajectory_file,
          "file for the final trajectory of base_frame in map_frame (TUM format), written when the node ends; empty: "
          "none");
    visit("map_frame", self.map_frame, "frame of the map");
    visit("odom_frame", self.odom_frame, "frame of the continuous odometry");
    visit("base_frame", self.base_frame, "frame of the robot, with x forward, y left, z up");
    visit("body_frame", self.body_frame,
          "tf frame that is the body frame of the rig file; empty: the body frame is base_frame");
    visit("publish_tf", self.publish_tf, "publish the transforms map -> odom and odom -> base_link");
    visit("publish_odom_tf", self.publish_odom_tf,
          "false: odom -> base_link is published by another node, such as wheel odometry");
    visit("publish_camera_tf", self.publish_camera_tf,
          "publish static transforms from base_link to the cameras as in the rig; false if a robot description does");
    visit("sync_tolerance", self.sync_tolerance, "maximum time between images of a frame, s");
    visit("max_wait", self.max_wait, "maximum delay of an image relative to images of other cameras, s");
    visit("max_bundles", self.max_bundles, "number of frames that may wait for SLAM before the oldest is dropped");
    visit("queue_size", self.queue_size, "queue of each subscription, messages");
    visit("significant_bits", self.significant_bits, "number of bits that the values of 16-bit images use, 8 to 16");
    visit("cloud_period", self.cloud_period, "minimum time between point clouds, s");
    visit("cloud_min_observations", self.cloud_min_observations, "minimum number of keyframes that observe a point");
    visit("path_period", self.path_period, "minimum time between paths, s");
    visit("path_max_poses", self.path_max_poses, "maximum number of poses in a path, which are evenly spaced");
    visit("history_frames", self.history_frames,
          "path and trajectory contain at least this number of last frames; 0: all");
  }

  // Errors name the parameter: no image topic, a value out of range, lists of different lengths, equal frames, a
  // setting without '=', rectified images without a rig file.
  bslam::Status check() const;

  // The settings of `config` and `settings`. Errors: those of bslam::Config.
  bslam::Result<bslam::Config> make_config() const;

  // The rig file with the cameras of `cameras`. Errors: those of bslam::Rig; a number of cameras that differs from the
  // number of image topics.
  bslam::Result<bslam::Rig> load_rig() const;

  // Topic of the calibration of camera i.
  std::string camera_info_topic(std::size_t i) const;
};

// Names of the cameras of a rig from CameraInfo: the folders of their image topics, such as "left" of
// /stereo/left/image_raw; "cam0", "cam1", ... unless these differ.
std::vector<std::string> camera_names(const Parameters& parameters);

// What to tell if base_link would have the axes of camera 0 (body_has_optical_axes).
std::string optical_axes_warning(const Parameters& parameters);

// Whether to ask for reliable delivery of images (ROS 2), given which of the publishers offer it: a subscription that
// does receives nothing from one that does not, whereas best effort is compatible with all.
bool subscribe_reliably(const std::vector<bool>& publishers);

// The file of the poses before the n-th change of the map by a service, n from 1: /data/walk_1.tum of /data/walk.tum.
std::string earlier_trajectory_file(const std::string& trajectory_file, std::size_t n);

// True for topics of rectified images by their names, such as /left/image_rect_color: K and D of CameraInfo do not
// describe them. The images of image_rect_raw have the lens's own distortion, which CameraInfo describes.
bool is_rectified(const std::string& topic);

// True for topics of sensor_msgs/CompressedImage.
bool is_compressed(const std::string& topic);

}  // namespace bslam_ros
