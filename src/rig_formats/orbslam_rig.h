// The calibration part of ORB-SLAM3's settings files, and the older form of ORB-SLAM2 (docs/calibration.md).
#pragma once

#include <filesystem>
#include <string>

#include "camera/camera_description.h"

namespace bslam::rig_formats {

// One camera or two. Camera.type PinHole (k1 k2 p1 p2 [k3]), KannalaBrandt8 or Rectified; keys CameraN.fx or, older,
// Camera.fx. The second camera stands by Stereo.T_c1_c2 (camera 2 to camera 1; older: Tlr), by a baseline to the right
// (Stereo.b, or Camera.bf / Camera.fx), or by the rectification LEFT.* and RIGHT.* of raw images. IMU.T_b_c1 (older:
// Tbc) is the place of camera 1 in the body; without it the body frame is camera 1. Camera 2 has coefficients of its
// own also as KannalaBrandt8. The virtual baseline of an RGB-D file makes no camera.
Result<camera::RigReading> read_orbslam_rig(const std::filesystem::path& file, const std::string& text);

// One or two cameras of one resolution, both fisheyes or both not. T_c1_c2 is a product: read back it may differ in the
// last bits.
Result<std::string> orbslam_rig_text(const camera::Rig& rig, const std::string& out);

}  // namespace bslam::rig_formats
