// Reads and writes the cameras of OKVIS2's configuration file (docs/calibration.md).
#pragma once

#include <filesystem>
#include <string>

#include "camera/camera_description.h"

namespace bslam::rig_formats {

// The list `cameras`: T_SC (camera to IMU, sixteen numbers), image_dimension, focal_length, principal_point, and
// distortion_coefficients of the distortion_type radialtangential, radialtangential8 or equidistant, or plumb_bob and
// plumb_bob8, which are other names of the first two. The image_delay of camera_parameters, or imageDelay in files of
// OKVIS, is subtracted from the time stamps of all cameras. Everything else is ignored.
Result<camera::RigReading> read_okvis_rig(const std::filesystem::path& file, const std::string& text);

// Reading the text back gives exactly the same rig, except that a pinhole becomes pinhole-radtan with coefficients that
// are 0.
Result<std::string> okvis_rig_text(const camera::Rig& rig, const std::string& out);

}  // namespace bslam::rig_formats
