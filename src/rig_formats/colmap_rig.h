// Reads and writes rigs in COLMAP's text format: cameras.txt with rigs.txt or rig_config.json (docs/calibration.md).
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "camera/camera_description.h"

namespace bslam::rig_formats {

// Reads the folder that contains the three files. Models and resolutions are read from cameras.txt. The extrinsics,
// camera from rig, are read from rigs.txt if it exists, else from rig_config.json, whose cameras must correspond to
// the cameras of cameras.txt in the order of their ids, and whose camera_params take precedence. Camera names are the
// image folders in rig_config.json. A single camera needs neither file. The body frame is the rig frame. Pixel (0.5,
// 0.5) of COLMAP is pixel (0, 0) here. Models: SIMPLE_PINHOLE, PINHOLE, SIMPLE_RADIAL, RADIAL, OPENCV, FULL_OPENCV,
// OPENCV_FISHEYE, FOV, EUCM.
Result<camera::RigReading> read_colmap_rig(const std::filesystem::path& folder);

// Returns name and content of cameras.txt, rigs.txt and rig_config.json. Camera 0 is the reference sensor. When read
// back, extrinsics and principal points may differ in the last bits, since they are inverted and shifted by half a
// pixel.
using NamedText = std::pair<std::string, std::string>;
Result<std::vector<NamedText>> colmap_rig_texts(const camera::Rig& rig, const std::string& out);

}  // namespace bslam::rig_formats
