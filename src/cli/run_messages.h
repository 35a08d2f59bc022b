// The terminal output of `bslam run`. All of its content is also in the summary.
#pragma once

#include <string>

#include "camera/rig.h"
#include "session/run_record.h"

namespace bslam::cli {

// Prints the first plausibility warnings about the calibration (calibration/rig_warnings.h) to stderr, before the run.
void print_rig_warnings(const camera::Rig& rig);

// Prints warnings to stderr: cameras that were out or inconsistent with all other cameras, images that could not be
// used, dropped frames, extrinsics that are inconsistent with the images, and overlapping cameras of `rig` (the cameras
// in use) without matches. `check_command` tests the calibration against the images; it is printed for the user to
// copy.
void print_warnings(const session::RunRecord& record, const camera::Rig& rig, const std::string& check_command);

// Prints to stdout how many frames have a pose, the size of the map, and where the files are.
void print_result(const session::RunRecord& record, const std::string& out);

}  // namespace bslam::cli
