// Warnings about the calibration that was estimated during a run.
#pragma once

#include <string>
#include <vector>

#include "camera/rig.h"
#include "session/run_record.h"

namespace bslam::session {

// Cameras whose estimate differs from the calibration `rig` (that of the cameras in use) by much, or that were moved,
// and what became of an estimate that contradicts it. Empty if the images do not belong to the calibration, in which
// case the estimate is meaningless.
std::vector<std::string> estimate_warnings(const RunRecord& record, const camera::Rig& rig);

// Says by how much the images contradict the calibration.
std::string contradiction_text(const RunRecord& record);

}  // namespace bslam::session
