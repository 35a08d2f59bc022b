// The trajectory of a run in the world frame of a map into which the map of the run was merged.
#pragma once

#include "base/result.h"
#include "evaluation/trajectory.h"
#include "storage/map_file.h"

namespace bslam::session {

struct TransferredTrajectory {
  evaluation::Trajectory poses;
  std::size_t submap = 0;     // index among the submaps of `merged`
  std::size_t keyframes = 0;  // number of keyframes of the run that both maps contain
};

// Moves each pose by the transforms of the keyframes before and after it between the two maps. Keyframes are identified
// by their keypoints (identity_of), so that any number of merges may lie between the maps. `trajectory` must be of the
// run that wrote `own`; of several submaps, the one with most keyframes at the times of its poses is used. Error:
// `merged` has none of them.
Result<TransferredTrajectory> transfer_trajectory(const evaluation::Trajectory& trajectory,
                                                  const storage::SavedMap& own, const storage::SavedMap& merged);

}  // namespace bslam::session
