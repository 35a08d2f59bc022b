// COLMAP's rigs as text: cameras.txt with rigs.txt or rig_config.json (docs/calibration.md).
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "camera/camera_description.h"

namespace bslam::rig_formats {

// Reads the folder of any of the three files. cameras.txt tells models and resolutions; the extrinsics, camera from
// rig, come from rigs.txt where it exists, else from rig_config.json, whose cameras are those of cameras.txt in order
// of their ids and whose camera_params win. Names are those of the folders in rig_config.json. One camera needs
// neither. The body frame is the rig's. COLMAP's pixel (0.5, 0.5) is our (0, 0). Models SIMPLE_PINHOLE, PINHOLE,
// SIMPLE_RADIAL, RADIAL, OPENCV, FULL_OPENCV, OPENCV_FISHEYE.
Result<camera::RigReading> read_colmap_rig(const std::filesystem::path& folder);

// cameras.txt, rigs.txt and rig_config.json as name and content. Camera 0 is the reference sensor. Extrinsics are
// inverted and principal points moved by half a pixel: read back both may differ in the last bits.
using NamedText = std::pair<std::string, std::string>;
Result<std::vector<NamedText>> colmap_rig_texts(const camera::Rig& rig, const std::string& out);

}  // namespace bslam::rig_formats
