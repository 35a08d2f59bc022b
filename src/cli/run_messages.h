// What `bslam run` says on the terminal when it is done; everything is in the summary as well.
#pragma once

#include <string>

#include "camera/rig.h"
#include "session/run_record.h"

namespace bslam::cli {

// On stderr, before the run: what is probably wrong with the calibration (rig_formats/rig_warnings.h), the first of it.
void print_rig_warnings(const camera::Rig& rig);

// Prints warnings to stderr: cameras that were out or consistent with no other camera, images that could not be used,
// dropped frames, extrinsics that do not fit the images, and overlapping cameras of `rig` (the cameras in use) without
// matches. `check_command` tests the calibration against the images; it is printed for the user to copy.
void print_warnings(const session::RunRecord& record, const camera::Rig& rig, const std::string& check_command);

// On stdout: how many frames have a pose, the size of the map, where the files are.
void print_result(const session::RunRecord& record, const std::string& out);

}  // namespace bslam::cli
