// The trajectory of a run in the world frame of a map into which the map of the run was merged.
#pragma once

#include "base/result.h"
#include "evaluation/trajectory.h"
#include "evaluation/trajectory_header.h"
#include "storage/map_file.h"

namespace bslam::session {

struct TransferredTrajectory {
  evaluation::Trajectory poses;
  std::size_t submap = 0;     // index among the submaps of `merged`
  std::size_t keyframes = 0;  // number of keyframes of the run that both maps contain
};

// Moves each pose by the transforms of the keyframes before and after it between the two maps. Keyframes are identified
// by their keypoints (identity_of), so that any number of merges may lie between the maps. `trajectory` must be of the
// run that wrote `own`, and may have been moved to the body or another camera. The keyframes are those at the times of
// its poses that have these poses, in the submap with most of them. `comments` are those of the file of `trajectory`:
// of times without the time offset of camera 0, and of poses that were reported during the run, which differ more from
// those of the map. Errors: `merged` has none of the keyframes of `own`; no keyframe of `own` has the pose of the
// trajectory at its time.
Result<TransferredTrajectory> transfer_trajectory(const evaluation::Trajectory& trajectory,
                                                  const storage::SavedMap& own, const storage::SavedMap& merged,
                                                  const evaluation::TrajectoryComments& comments = {});

}  // namespace bslam::session
