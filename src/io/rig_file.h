// Rig calibrations in files.
#pragma once

#include <filesystem>
#include <string>

#include "base/result.h"
#include "camera/rig.h"

namespace bslam::io {

// Reads a rig of any known format: our YAML (`bslam_rig: 1`, docs/cli.md), an EuRoC sensor.yaml (one camera), a KITTI
// calib.txt with its images beside it; or, where `path` is a folder, the calibration an EuRoC or KITTI data set
// carries. Errors name file and key: what make_camera checks, missing, unknown and repeated keys, wrong types, YAML
// syntax.
Result<camera::Rig> read_rig(const std::filesystem::path& path);

// The rig in our format; reading it back gives the same numbers. Mask files are written as they stand in the rig.
std::string rig_to_yaml(const camera::Rig& rig);
Status write_rig(const camera::Rig& rig, const std::filesystem::path& file);

}  // namespace bslam::io
