// The comment lines of a trajectory file.
#pragma once

#include <optional>
#include <span>
#include <string>

#include "evaluation/trajectory_file.h"
#include "session/run_record.h"
#include "system/system.h"

namespace bslam::session {

// The number of a submap in the map of the run, whose roots are `roots`: that of `bslam map info`. nullopt if it is not
// in the map at the end, as submaps of live poses that were merged.
std::optional<std::size_t> submap_number(KeyframeId root, std::span<const KeyframeId> roots);

// Returns the comment lines of the trajectory of submaps[index], without the leading "# ": the header of
// evaluation/trajectory_file.h; the number of the submap, and which share of the frames it contains, if there are
// several; whether its world frame is that of the loaded map; the intervals without a pose and their reasons. `roots`:
// those of the map of the run.
std::string trajectory_comments(const RunRecord& record, std::span<const system::SubmapTrajectory> submaps,
                                std::size_t index, evaluation::PoseState state, std::span<const KeyframeId> roots);

}  // namespace bslam::session
