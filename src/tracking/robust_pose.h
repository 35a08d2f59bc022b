// The pose of a frame when a considerable part of what the cameras see may move.
#pragma once

#include <span>

#include "map/bundled_map.h"
#include "solver/pose_solver.h"
#include "tracking/frame_matches.h"

namespace bslam::tracking {

// The sum over the inliers of the number of keyframes that observe the landmark, at most three each: landmarks on
// objects that move are observed by few.
int support(const map::BundledMap& map, const FrameMatches& matches, std::span<const std::uint8_t> inlier);

// As solver::solve_pose for the matches of a frame, in order; `predicted` is the initial pose. A robust kernel follows
// the majority, and ends between two motions that many matches agree with. If a considerable part of the matches are
// outliers, a second pose is estimated from those that agree with the prediction at the beginning; it is
// returned if its support is clearly larger.
solver::PoseSolution robust_pose(const map::BundledMap& map, const FrameMatches& matches,
                                 std::span<const solver::PoseObservation> observations, const geometry::SE3& predicted,
                                 const solver::MotionModel& motion, const solver::PoseSolverOptions& options);

}  // namespace bslam::tracking
