// Reads and writes the calibration in settings files of ORB-SLAM3, and reads the older form of ORB-SLAM2
// (docs/calibration.md).
#pragma once

#include <filesystem>
#include <string>

#include "camera/camera_description.h"

namespace bslam::rig_formats {

// Reads one or two cameras. Camera.type PinHole (k1 k2 p1 p2 [k3]), KannalaBrandt8 or Rectified; keys CameraN.fx or,
// older, Camera.fx. The pose of the second camera is given by Stereo.T_c1_c2 (camera 2 to camera 1; older: Tlr), by a
// baseline to the right (Stereo.b, or Camera.bf / Camera.fx), or by the rectification LEFT.* and RIGHT.* of raw images.
// IMU.T_b_c1 (older: Tbc) is the pose of camera 1 in the body; without it the body frame is camera 1. Camera 2 has
// its own coefficients, also for KannalaBrandt8. The virtual baseline of an RGB-D file is ignored, and one camera is
// read.
Result<camera::RigReading> read_orbslam_rig(const std::filesystem::path& file, const std::string& text);

// Writes one or two cameras with equal resolution, both or neither of them a fisheye. When read back, T_c1_c2 may
// differ in the last bits, since it is a product.
Result<std::string> orbslam_rig_text(const camera::Rig& rig, const std::string& out);

}  // namespace bslam::rig_formats
