// Reads and writes the calibration JSON of Basalt (docs/calibration.md).
#pragma once

#include <filesystem>
#include <string>

#include "camera/camera_description.h"

namespace bslam::rig_formats {

// Reads value0 with T_imu_cam (camera to IMU, quaternion x y z w), intrinsics of camera_type pinhole, pinhole-radtan8,
// kb4, ucm, eucm or ds, resolution, and cam_time_offset_ns, which is added to the time stamps of all cameras.
Result<camera::RigReading> read_basalt_rig(const std::filesystem::path& file, const std::string& text);

// Reading the text back gives exactly the same rig. Calibration values of the IMU are written as zeros.
Result<std::string> basalt_rig_text(const camera::Rig& rig, const std::string& out);

}  // namespace bslam::rig_formats
