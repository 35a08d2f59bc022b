// The part of a map from which the calibration is estimated.
#pragma once

#include <vector>

#include "adjustment/bundle_problem.h"
#include "calibration/rig_refinement.h"

namespace bslam::calibration {

// The adjustment problem and the group of each of its poses, by the index of a pose of the group.
struct RigProblem {
  adjustment::BundleProblem selected;
  std::vector<std::size_t> group;
};

// Chooses keyframes and landmarks that are distributed over the map. Each group has its own gauge freedom: one keyframe
// per group is fixed, which does not constrain the extrinsics. `timing`: the timing of the cameras is estimated, for
// which only keyframes of known velocity are used. Here the rig frame is that of camera 0 (solver::RigValues), and
// moves of cameras are not part of the motions (MovedCameras::separate).
RigProblem choose(const map::BundledMap& map, bool timing, const CalibrationOptions& options,
                  const feature::FeatureModel& features);

// The time of a pose of the problem, and the poses in order of time, which is not always that of their creation.
TimeNs time_of(const map::BundledMap& map, const RigProblem& problem, std::size_t pose);
std::vector<std::size_t> poses_by_time(const map::BundledMap& map, const RigProblem& problem);

// Removes the observations of a point by groups other than the one with the most observations (the first one on ties).
// Otherwise the point would connect two fixed keyframes, and their distance would constrain lengths, which the
// extrinsics have to determine. If poses are thereby no longer connected to the fixed one of their group, one of them
// is fixed as well.
void separate_groups(RigProblem& problem);

}  // namespace bslam::calibration
