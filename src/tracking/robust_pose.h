// Estimates the pose of a frame in which a considerable part of the scene may be moving.
#pragma once

#include <span>
#include <vector>

#include "solver/pose_solver.h"
#include "tracking/landmark_support.h"
#include "tracking/track.h"

namespace bslam::tracking {

// Returns true if the map is so new that no landmark can have been observed for a long time.
bool newly_started(const TrackInput& input, const frame::BundledFrame& frame);

// A pose chosen among those of several motions.
struct ChosenPose {
  solver::PoseSolution solution;
  // Number of matches but for those that show another motion: these are no evidence against the pose.
  std::size_t matches = 0;
  MotionContest contest{};
};

// As solver::solve_pose for the matches of a frame, in order; `predicted` is the initial pose. A robust kernel
// converges to the majority of the matches, or between two motions that both have many matches. If a considerable part
// of the matches are outliers, further poses are estimated: from the outliers, from the matches that agree with the
// prediction, from those of confirmed landmarks, and by RANSAC if still most of them are outliers. Another pose
// replaces the first one if its support is clearly larger, or if the first one could not be estimated. In a map that
// was just started, the agreement of all keypoints adds to the support (tracking/scene_agreement.h).
ChosenPose robust_pose(const TrackInput& input, const frame::BundledFrame& frame, const FrameMatches& matches,
                       std::span<const solver::PoseObservation> observations, const geometry::SE3& predicted,
                       const solver::MotionModel& motion, const solver::PoseSolverOptions& options);

// The same for matches found in wide windows, many of which are wrong: the first pose and that of its outliers are
// estimated by RANSAC.
ChosenPose sampled_pose(const TrackInput& input, const frame::BundledFrame& frame, const FrameMatches& matches,
                        std::span<const solver::PoseObservation> observations, const geometry::SE3& predicted,
                        const solver::PoseSolverOptions& options);

}  // namespace bslam::tracking
