// Reads and writes the rig file of bslam: YAML with `bslam_rig: 1` (docs/cli.md).
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "camera/camera_description.h"

namespace bslam::rig_formats {

// Reads the text of a rig file. `file` is used in errors and to resolve relative paths of masks. Unknown and repeated
// keys are errors.
Result<camera::RigReading> read_bslam_rig(const std::filesystem::path& file, const std::string& text);

// Returns the rig as YAML. The format stores everything a rig contains, and reading it back gives exactly the same rig.
// Paths of masks are written unchanged. `topics`: see camera::RigReading.
std::string rig_to_yaml(const camera::Rig& rig, const std::vector<std::string>& topics = {});

}  // namespace bslam::rig_formats
