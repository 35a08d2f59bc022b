// Reads and writes the calibration of EuRoC: one `sensor.yaml` per camera, with T_BS = T_body_cam (Burri et al., IJRR
// 2016).
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"
#include "camera/rig.h"

namespace bslam::rig_formats {

// Reads `camera_model: pinhole` with `distortion_model` radial-tangential (radtan), equidistant or none. Unknown keys
// are ignored, since the format has many. `name` becomes the name of the camera.
Result<camera::RigCamera> read_euroc_sensor(const std::filesystem::path& file, const std::string& name);

// Files in the folder of a recording that is being written image by image, and of one that is complete.
inline constexpr const char* kPartial = ".partial";
inline constexpr const char* kComplete = ".complete";

// Returns the folders cam0, cam1, ... in `folder` that contain `entry`, ordered by number.
std::vector<std::filesystem::path> camera_folders(const std::filesystem::path& folder, const std::string& entry);

// Returns the folder with the cameras of an EuRoC data set: DATA/mav0 if it exists, else DATA itself.
std::filesystem::path euroc_root(const std::filesystem::path& data);

// Returns true if the format supports the models of all cameras.
bool euroc_holds_models(const camera::Rig& rig);

// Returns the content of sensor.yaml for one camera, whose model must be supported. `rate_hz` is written for
// information only. The format stores no name, time offset or mask.
std::string euroc_sensor_yaml(const camera::RigCamera& camera, double rate_hz);

// Writes FOLDER/mav0/camN/sensor.yaml for every camera and creates the folders. Errors: a camera with a time offset, a
// mask or an unsupported model; a folder or file that cannot be written.
Status write_euroc_sensors(const camera::Rig& rig, const std::filesystem::path& folder, double rate_hz);

}  // namespace bslam::rig_formats
