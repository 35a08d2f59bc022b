// Reads and writes Kalibr's camchain.yaml and the variant of OpenVINS (docs/calibration.md).
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "camera/camera_description.h"

namespace bslam::rig_formats {

// cam0, cam1, ...: camera_model pinhole, omni, eucm or ds with distortion_model none, radtan, equidistant or fov;
// extrinsics from T_imu_cam (OpenVINS: camera to IMU), T_cam_imu (IMU to camera) or the chain T_cn_cnm1 (camera n-1 to
// camera n); timeshift_cam_imu: t_imu = t_cam + shift. Without an IMU the body frame is camera 0. An omni camera with
// distortion is an error, since no model of bslam is equivalent to it. rostopic: the topic of the images.
Result<camera::RigReading> read_kalibr_rig(const std::filesystem::path& file, const std::string& text);

// When read back, extrinsics may differ in the last bits, since T_cam_imu and T_cn_cnm1 are inverses and products.
// `topics`: see camera::RigReading; without one, rostopic is that of the name camN.
Result<std::string> kalibr_rig_text(const camera::Rig& rig, const std::string& out,
                                    const std::vector<std::string>& topics);
// Writes T_imu_cam, which is read back exactly.
Result<std::string> openvins_rig_text(const camera::Rig& rig, const std::string& out,
                                      const std::vector<std::string>& topics);

}  // namespace bslam::rig_formats
