// KITTI odometry's calibration: `calib.txt` with the 3x4 projections P0..P3 of the rectified cameras (Geiger et al.,
// 2012).
#pragma once

#include <filesystem>
#include <vector>

#include "base/result.h"
#include "camera/rig.h"

namespace bslam::rig_formats {

struct KittiProjection {
  int camera = 0;                 // the number in "P2"
  camera::Intrinsics intrinsics;  // pixels
  geometry::Vector3d position;    // metres: of the camera in the frame of camera 0, -K^-1 p4; its axes are camera 0's
};

// The lines "P0:" to "P3:" in their order; other lines are not read. Errors: none of them, one that is not twelve
// finite numbers, one twice, focal lengths not above 0, a left 3x3 that is no [fx 0 cx; 0 fy cy; 0 0 1].
Result<std::vector<KittiProjection>> read_kitti_calib(const std::filesystem::path& file);

// The folder image_N that belongs to a projection, beside calib.txt.
std::filesystem::path kitti_image_folder(const std::filesystem::path& data, int camera);

// A camera of the calibration with the resolution of its images, which calib.txt does not tell. Its body frame is
// camera 0.
Result<camera::RigCamera> kitti_camera(const KittiProjection& projection, int width, int height,
                                       const std::filesystem::path& calib_file);

// The cameras of the calibration that have images beside it. Error where there are none.
Result<std::vector<camera::RigCamera>> read_kitti_cameras(const std::filesystem::path& calib_file);

}  // namespace bslam::rig_formats
