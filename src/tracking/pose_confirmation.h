// Whether matches confirm a pose although most of them are wrong.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "solver/pose_solver.h"
#include "tracking/track.h"

namespace bslam::tracking {

// The radius, in level-0 pixels, of the window in which each match was searched for, in the order of pose_observations.
// `radius`: that of the search, in radians.
std::vector<double> search_windows_px(const camera::Rig& rig, const frame::BundledFrame& frame,
                                      const FrameMatches& matches, double radius, double scale_factor);

// Flags the matches that agree with a pose, if there are clearly more of them than chance explains; otherwise flags
// none. A wrong match has a random position in its search window. `window_px`: radius of the window of each observation
// in level-0 pixels.
std::vector<std::uint8_t> agreeing_beyond_chance(const camera::Rig& rig,
                                                 std::span<const solver::PoseObservation> observations,
                                                 std::span<const double> window_px, const geometry::SE3& T_rig_world,
                                                 const solver::MotionModel& motion);

// Returns true if more matches of a frame agree with its pose than chance explains. `radius`: radians, that of the
// search which found them.
bool confirmed_by_matches(const TrackInput& input, const frame::BundledFrame& frame, const FrameMatches& matches,
                          double radius, const geometry::SE3& T_rig_world);

}  // namespace bslam::tracking
