// The loop closures of a run as lines between keyframes of the report.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "session/run_record.h"

namespace bslam::session {

// The keyframes at both ends of a loop closure: indices into the list of their submap.
struct ReportLoop {
  std::size_t submap = 0, at = 0, with = 0;
};

// Finds the keyframes that are nearest in time; the keyframe of a closure itself may have been culled. A closure whose
// ends are in different submaps belongs to a map that was discarded, and is left out. `times`: for each submap the
// times of its keyframes in ascending order.
std::vector<ReportLoop> report_loops(std::span<const PlaceEvent> loops, std::span<const std::vector<float>> times);

}  // namespace bslam::session
