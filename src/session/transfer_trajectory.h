// The trajectory of a run in the world frame of a map into which the map of the run was merged.
#pragma once

#include "base/result.h"
#include "evaluation/trajectory.h"
#include "storage/map_file.h"

namespace bslam::session {

struct TransferredTrajectory {
  evaluation::Trajectory poses;
  std::size_t submap = 0;     // of `merged`: position among its submaps
  std::size_t keyframes = 0;  // keyframes of the run that connect both maps
};

// Moves each pose as the keyframes before and after it have moved between the two maps. Keyframes are recognised by
// their descriptors, so that it does not matter how many merges are between the maps. `trajectory` must be of the run
// that wrote `own`; of several submaps, the one with most keyframes at the times of its poses is used. Error: `merged`
// has none of them.
Result<TransferredTrajectory> transfer_trajectory(const evaluation::Trajectory& trajectory,
                                                  const storage::SavedMap& own, const storage::SavedMap& merged);

}  // namespace bslam::session
