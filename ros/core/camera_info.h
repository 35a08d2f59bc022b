// A rig from sensor_msgs/CameraInfo and the transforms between the frames of the cameras.
#pragma once

#include <bslam/bslam.h>

#include <cstddef>
#include <string>
#include <vector>

#include "core/geometry.h"

namespace bslam_ros {

// Fields of sensor_msgs/CameraInfo; `binning` 0 means 1, a region of interest of size 0 means the full image.
struct CameraInfo {
  std::string frame_id;
  std::size_t width = 0, height = 0;  // of the sensor, before binning and region of interest
  std::string distortion_model;       // plumb_bob (or empty), rational_polynomial, equidistant, fisheye or
                                      // kannala_brandt
  std::vector<double> D;
  std::array<double, 9> K = {};
  std::size_t binning_x = 0, binning_y = 0;
  std::size_t roi_x = 0, roi_y = 0, roi_width = 0, roi_height = 0;  // pixels of the sensor
};

// The calibration of raw (neither rectified nor undistorted) images. Errors name the field: an unknown distortion
// model, more coefficients than it has, a calibration that was not done (K is zero). Ranges are checked by Rig::make.
bslam::Result<bslam::CameraCalibration> to_calibration(const CameraInfo& info, const std::string& camera,
                                                       const Pose& T_base_cam);

// The rig of several cameras, with base_link as body frame. `T_base_cam`: poses of the optical frames of the cameras in
// it, in the same order. Errors, besides those of to_calibration: two cameras with the same frame.
bslam::Result<bslam::Rig> make_rig(const std::vector<CameraInfo>& infos, const std::vector<std::string>& cameras,
                                   const std::vector<Pose>& T_base_cam);

}  // namespace bslam_ros
