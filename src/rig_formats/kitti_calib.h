// Reads the calibration of KITTI odometry: `calib.txt` with the 3x4 projections P0..P3 of the rectified cameras (Geiger
// et al., 2012).
#pragma once

#include <filesystem>
#include <vector>

#include "base/result.h"
#include "camera/rig.h"

namespace bslam::rig_formats {

struct KittiProjection {
  int camera = 0;                 // the number in "P2"
  camera::Intrinsics intrinsics;  // pixels
  geometry::Vector3d
      position;  // metres: camera centre in the frame of camera 0, -K^-1 p4; all cameras have the same axes
};

// Reads the lines "P0:" to "P3:" in their order and ignores other lines. Errors: no such line; a line without twelve
// finite numbers; a repeated line; focal lengths that are not positive; a left 3x3 part other than [fx 0 cx; 0 fy cy; 0
// 0 1].
Result<std::vector<KittiProjection>> read_kitti_calib(const std::filesystem::path& file);

// The folder image_N of a camera, in the folder of calib.txt.
std::filesystem::path kitti_image_folder(const std::filesystem::path& data, int camera);

// A camera of the calibration. The resolution is that of its images, since calib.txt does not contain it. The body
// frame is camera 0.
Result<camera::RigCamera> kitti_camera(const KittiProjection& projection, int width, int height,
                                       const std::filesystem::path& calib_file);

// The cameras of the calibration with images in the folder of calib.txt. Error if there are none.
Result<std::vector<camera::RigCamera>> read_kitti_cameras(const std::filesystem::path& calib_file);

}  // namespace bslam::rig_formats
