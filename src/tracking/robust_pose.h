// The pose of a frame when a considerable part of what the cameras see may move.
#pragma once

#include <span>
#include <vector>

#include "solver/pose_solver.h"
#include "tracking/track.h"

namespace bslam::tracking {

// How far the inliers of a frame spread over its images and over time. Each cell of a grid of 8 x 8 on every image that
// has inliers counts a half, plus the time, in seconds and at most one, between the first and the last keyframe that
// observe the landmark of one of them, the longest. An object that moves covers a small part of the images, however
// many of its landmarks are found, and they soon become outliers. `observations` are those of `matches`, in order.
double support(const map::BundledMap& map, const FrameMatches& matches,
               std::span<const solver::PoseObservation> observations, std::span<const std::uint8_t> inlier);

// Whether landmarks that keyframes observed for long are found about as often as those observed for a short time.
// `visible`: all that were searched for. What moves has been observed for a short time only: if that is what is found
// and the rest is not, the pose is that relative to a moving object. True if too few of either
// are visible to tell.
bool lasting_landmarks_found(const map::BundledMap& map, std::span<const LandmarkId> visible,
                             const FrameMatches& matches, std::span<const std::uint8_t> inlier);

// Whether the map was started so short a time before the frame that no landmark has been observed for long.
bool newly_started(const TrackInput& input, const frame::BundledFrame& frame);

// Flags the matches that agree with a pose, if they are clearly more than of wrong matches would; otherwise none. A
// wrong match is anywhere in its search window; `window_px` is the radius of that of each observation.
std::vector<std::uint8_t> agreeing_beyond_chance(const camera::Rig& rig,
                                                 std::span<const solver::PoseObservation> observations,
                                                 std::span<const double> window_px, const geometry::SE3& T_rig_world,
                                                 const solver::MotionModel& motion);

// As solver::solve_pose for the matches of a frame, in order; `predicted` is the initial pose. A robust kernel follows
// the majority, and ends between two motions that many matches agree with. If a considerable part of the matches are
// outliers, further poses are estimated: from the outliers, from the matches that agree with the prediction, and by
// RANSAC if still most of them are outliers. Another pose replaces the first one if its support is clearly larger, or
// if the first one could not be estimated. In a map that was just started, the agreement of all keypoints adds to the
// support (tracking/scene_agreement.h).
solver::PoseSolution robust_pose(const TrackInput& input, const frame::BundledFrame& frame, const FrameMatches& matches,
                                 std::span<const solver::PoseObservation> observations, const geometry::SE3& predicted,
                                 const solver::MotionModel& motion, const solver::PoseSolverOptions& options);

// The same for matches found in wide windows, many of which are wrong: the first pose and that of its outliers are
// estimated by RANSAC.
solver::PoseSolution sampled_pose(const TrackInput& input, const frame::BundledFrame& frame,
                                  const FrameMatches& matches, std::span<const solver::PoseObservation> observations,
                                  const geometry::SE3& predicted, const solver::PoseSolverOptions& options);

}  // namespace bslam::tracking
