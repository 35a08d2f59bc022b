// How much the landmarks that agree with a pose show that it is the pose in the static scene. Those on a moving object
// agree with few frames, and are observed for a short time.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "map/map_edit.h"
#include "solver/pose_solver.h"
#include "tracking/frame_matches.h"
#include "tracking/track.h"

namespace bslam::tracking {

inline constexpr double kCellSupport = 0.5;     // support of a cell of an image, see LandmarkSupport
inline constexpr double kLongObserved_s = 1.0;  // landmarks observed by keyframes for longer are trusted

// Per match: whether the landmark has agreed with other frames than the keyframe that created it: a later keyframe
// observes it, or it was found in at least two frames and in a third of those in which it was expected. A landmark on a
// moving object is not confirmed as long as the poses are right. The counts of the state are not yet in the map.
std::vector<std::uint8_t> confirmed_landmarks(const map::BundledMap& map, const TrackerState& state,
                                              const FrameMatches& matches);

// The support of a pose by landmarks: how widely its inliers are spread over the images and over time. Each image has a
// grid of 8 x 8 cells. A cell with inliers counts 1/2, or 1/10 if none of their landmarks is confirmed (`spread`),
// + min(1, t) (`lasting`), where t is the longest time in seconds between the first and the last keyframe that observe
// the landmark of one of its inliers. A moving object covers few cells, however many of its landmarks are found, and
// they soon become outliers. `observations` are those of `matches`, in order. `confirmed`: one flag per match; empty if
// all are.
struct LandmarkSupport {
  double spread = 0.0, lasting = 0.0;
  double sum() const { return spread + lasting; }
};
LandmarkSupport support(const map::BundledMap& map, const FrameMatches& matches,
                        std::span<const solver::PoseObservation> observations, std::span<const std::uint8_t> inlier,
                        std::span<const std::uint8_t> confirmed = {});

// Returns true if landmarks that keyframes have observed for a long time are found about as often as those observed for
// a short time. `visible`: all landmarks that were searched for. Landmarks on a moving object have only been observed
// for a short time. If mainly these are found, the pose is relative to a moving object. Returns true if too few of
// either kind are visible to decide.
bool lasting_landmarks_found(const map::BundledMap& map, std::span<const LandmarkId> visible,
                             const FrameMatches& matches, std::span<const std::uint8_t> inlier);

}  // namespace bslam::tracking
