// Reads the calibration of KITTI odometry: `calib.txt` with the 3x4 projections P0..P3 of the rectified cameras (Geiger
// et al., 2012).
#pragma once

#include <filesystem>
#include <vector>

#include "base/result.h"
#include "camera/rig.h"

namespace bslam::rig_formats {

struct KittiProjection {
  int camera = 0;                 // camera number, for example 2 for the line "P2"
  camera::Intrinsics intrinsics;  // pixels
  // Camera centre in the frame of camera 0, -K^-1 p4, in metres. All cameras have the same orientation.
  geometry::Vector3d position;
};

// Reads the lines "P0:" to "P3:" in the order of the file and ignores other lines. Errors: the file has no such line; a
// line does not have twelve finite numbers; a line is repeated; a focal length is not positive; the left 3x3 part is
// not [fx 0 cx; 0 fy cy; 0 0 1].
Result<std::vector<KittiProjection>> read_kitti_calib(const std::filesystem::path& file);

// Returns the folder image_N of a camera, which is in the folder of calib.txt.
std::filesystem::path kitti_image_folder(const std::filesystem::path& data, int camera);

// Returns a camera of the calibration. `width` and `height` are the size of its images, since calib.txt does not
// contain the resolution. `calib_file` is used in errors. The body frame is camera 0.
Result<camera::RigCamera> kitti_camera(const KittiProjection& projection, int width, int height,
                                       const std::filesystem::path& calib_file);

// Returns the cameras of the calibration that have images in the folder of calib.txt. Error if there are none.
Result<std::vector<camera::RigCamera>> read_kitti_cameras(const std::filesystem::path& calib_file);

}  // namespace bslam::rig_formats
