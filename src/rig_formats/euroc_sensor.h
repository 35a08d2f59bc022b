// EuRoC's calibration: one `sensor.yaml` a camera, with T_BS = T_body_cam (Burri et al., IJRR 2016).
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"
#include "camera/rig.h"

namespace bslam::rig_formats {

// Reads `camera_model: pinhole` with `distortion_model` radial-tangential (radtan), equidistant or none. Keys it does
// not know are left alone: the format has many. The camera is called `name`.
Result<camera::RigCamera> read_euroc_sensor(const std::filesystem::path& file, const std::string& name);

// Folders cam0, cam1, ... directly in `folder` that hold `entry`, by number; empty where there is none.
std::vector<std::filesystem::path> camera_folders(const std::filesystem::path& folder, const std::string& entry);

// The folder with the cameras of an EuRoC data set: DATA/mav0 where it exists, else DATA itself.
std::filesystem::path euroc_root(const std::filesystem::path& data);

// Can the format hold the models of all cameras?
bool euroc_holds_models(const camera::Rig& rig);

// One camera as a sensor.yaml, of a model that the format holds; `rate_hz` is for the reader only. The format holds no
// name, time offset or mask.
std::string euroc_sensor_yaml(const camera::RigCamera& camera, double rate_hz);

// Writes FOLDER/mav0/camN/sensor.yaml for every camera, making the folders. Errors: a camera with a time offset or a
// mask, or of a model that the format cannot hold; a folder or file that cannot be written.
Status write_euroc_sensors(const camera::Rig& rig, const std::filesystem::path& folder, double rate_hz);

}  // namespace bslam::rig_formats
