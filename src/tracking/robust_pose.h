// The pose of a frame when a considerable part of what the cameras see may move.
#pragma once

#include <span>

#include "solver/pose_solver.h"
#include "tracking/track.h"

namespace bslam::tracking {

// The sum over the inliers of the number of keyframes that observe the landmark, at most three each: landmarks on
// objects that move are observed by few.
int support(const map::BundledMap& map, const FrameMatches& matches, std::span<const std::uint8_t> inlier);

// As solver::solve_pose for the matches of a frame, in order; `predicted` is the initial pose. A robust kernel follows
// the majority, and ends between two motions that many matches agree with. If a considerable part of the matches are
// outliers, further poses are estimated: from those that agree with the prediction at the beginning, and by RANSAC if
// still most of them are outliers. Another pose replaces the first one if its support is clearly larger, or
// if the first one could not be estimated.
solver::PoseSolution robust_pose(const TrackInput& input, const frame::BundledFrame& frame, const FrameMatches& matches,
                                 std::span<const solver::PoseObservation> observations, const geometry::SE3& predicted,
                                 const solver::MotionModel& motion, const solver::PoseSolverOptions& options);

}  // namespace bslam::tracking
