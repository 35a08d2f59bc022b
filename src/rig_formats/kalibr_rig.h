// Kalibr's camchain.yaml and OpenVINS's variant of it (docs/calibration.md).
#pragma once

#include <filesystem>
#include <string>

#include "camera/camera_description.h"

namespace bslam::rig_formats {

// cam0, cam1, ...: camera_model pinhole, omni, eucm or ds with distortion_model none, radtan or equidistant; extrinsics
// from T_imu_cam (OpenVINS: camera to IMU), T_cam_imu (IMU to camera) or the chain T_cn_cnm1 (camera n-1 to camera n);
// timeshift_cam_imu: t_imu = t_cam + shift. Without any IMU the body frame is camera 0. An omni camera with distortion
// is refused: no model of ours is its equal.
Result<camera::RigReading> read_kalibr_rig(const std::filesystem::path& file, const std::string& text);

// T_cam_imu and T_cn_cnm1 are inverses and products: read back they may differ in the last bits.
Result<std::string> kalibr_rig_text(const camera::Rig& rig, const std::string& out);
// T_imu_cam: exact.
Result<std::string> openvins_rig_text(const camera::Rig& rig, const std::string& out);

}  // namespace bslam::rig_formats
