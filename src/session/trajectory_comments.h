// The comment lines of a trajectory file.
#pragma once

#include <span>
#include <string>

#include "evaluation/trajectory_file.h"
#include "session/run_record.h"
#include "system/system.h"

namespace bslam::session {

// Returns the comment lines of the trajectory of submap `index`, without the leading "# ": the header of
// evaluation/trajectory_file.h; which share of the frames it contains if there are several submaps; whether its world
// frame is that of the loaded map; the intervals without a pose and their reasons.
std::string trajectory_comments(const RunRecord& record, std::span<const system::SubmapTrajectory> submaps,
                                std::size_t index, evaluation::PoseState state);

}  // namespace bslam::session
