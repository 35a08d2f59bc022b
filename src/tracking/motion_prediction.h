// Poses predicted by a motion model of constant velocity.
#pragma once

#include <optional>

#include "tracking/relocaliser.h"
#include "tracking/track.h"

namespace bslam::tracking {

// Motion from the last pose to `time_ns`. Returns nullopt if it is not known.
std::optional<geometry::SE3> motion_since_last(const TrackerState& state, TimeNs time_ns);

// Returns true if the twist of the last frame holds for a frame at `time_ns` too. Frames that follow each other much
// faster than cameras record have stamps of their arrival, or are two images of one instant: noise would make their
// twist arbitrarily large. The twist is not kept twice in a row, since some cameras are that fast.
bool keeps_twist(const TrackerState& state, TimeNs time_ns);

// The last pose, T_rig_world, in the current map.
geometry::SE3 last_pose(const TrackInput& input);
// The last pose, advanced by the motion model if the motion is known.
geometry::SE3 predict(const TrackInput& input, TimeNs time_ns);

// Returns true if the rig can have come from its last pose to the place by `time_ns`: within the median distance of the
// landmarks matched there plus the way at twice its last speed. Returns true as well some seconds after the last pose,
// and if 40 % of the landmarks predicted at the place are found: it must have been carried there. Repeated structures
// match a smaller part of a place that is elsewhere.
bool is_plausible(const FoundPlace& place, const map::BundledMap& map, const TrackerState& state, TimeNs time_ns);

// Median distance, in pixels, by which the landmarks of the last frame moved in the images between the two frames from
// which the twist was computed; 0 if it is not known.
double image_motion_px(const map::BundledMap& map, const TrackerState& state);

// Motion during the capture of a frame: the motion since the last frame, extrapolated with its acceleration with
// respect to the interval before, or the last motion if that is kept. It is a function of the poses. It must not be
// estimated as a free variable from cameras with other capture times: the landmarks that they re-observe were created
// with the same error of the motion.
solver::MotionModel motion_model(const TrackInput& input, const frame::BundledFrame& frame);

}  // namespace bslam::tracking
