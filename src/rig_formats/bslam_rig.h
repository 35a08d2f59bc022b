// Our own rig file: YAML with `bslam_rig: 1` (docs/cli.md).
#pragma once

#include <filesystem>
#include <string>

#include "camera/camera_description.h"

namespace bslam::rig_formats {

// Reads the text of a rig file; `file` is for errors and for masks relative to it. Refuses unknown and repeated keys.
Result<camera::RigReading> read_bslam_rig(const std::filesystem::path& file, const std::string& text);

// The rig in our format, which holds everything a rig has; reading it back gives the same bits. Mask files are written
// as they stand in the rig.
std::string rig_to_yaml(const camera::Rig& rig);

}  // namespace bslam::rig_formats
