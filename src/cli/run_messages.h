// What `bslam run` says on the terminal when it is done; everything is in the summary as well.
#pragma once

#include <string>

#include "camera/rig.h"
#include "session/run_record.h"

namespace bslam::cli {

// On stderr, before the run: what is probably wrong with the calibration (rig_formats/rig_warnings.h), the first of it.
void print_rig_warnings(const camera::Rig& rig);

// On stderr: cameras that were out or agreed with nothing, images that could not be used, frames there was no time for,
// extrinsics that do not fit; and where cameras of `rig`, those in use, match nothing although they overlap.
void print_warnings(const session::RunRecord& record, const camera::Rig& rig);

// On stdout: how many frames have a pose, the size of the map, where the files are.
void print_result(const session::RunRecord& record, const std::string& out);

}  // namespace bslam::cli
