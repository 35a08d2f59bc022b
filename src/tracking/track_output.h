// Computes the result and the state for the next frame from the pose of a frame, for both front ends.
#pragma once

#include <vector>

#include "tracking/keyframe_decision.h"
#include "tracking/track.h"

namespace bslam::tracking {

// Landmarks of the last frame, and of the last image of cameras without an image in that frame, that still exist in the
// map; in order of id.
std::vector<LandmarkId> last_landmarks(const map::BundledMap& map, const TrackerState& state);

// Whether a pose has enough inliers: at least `min_inliers`, and a sufficient fraction of `num_matches`.
bool supported(const solver::PoseSolution& solution, std::size_t num_matches, int min_inliers,
               const TrackingOptions& options);

// The pose and the matches of a frame.
struct TrackedFrame {
  frame::BundledFrame frame;  // see TrackOutput::frame
  solver::PoseSolution solution;
  FrameMatches matches;             // all, inliers and outliers
  std::vector<LandmarkId> visible;  // landmarks that were searched for, each once
  MotionContest contest;
};

// The output for a frame with a pose. The states of its cameras and the decision on a keyframe are left to the caller.
TrackOutput output_of(const TrackInput& input, TrackedFrame found);

// Updates the state of a camera that is not excluded, such as the time of its last image and the landmarks that it
// observes. `inliers`: the inliers of this camera.
void update_used_camera(const frame::BundledFrame& frame, std::size_t c, const std::vector<Match>& inliers,
                        const ConsensusOptions& options, CameraConsensusState& camera);

// Whether the frame becomes a keyframe. `direct` as in evidence_by_reference (tracking/keyframe_decision.h). If a
// keyframe is due because the rig has moved away from a reference, but is back at a similar one, that becomes the
// reference instead, so that the map does not grow where it is complete.
bool keyframe_needed(const map::BundledMap& map, const TrackingOptions& options, bool direct, TrackOutput& out);

}  // namespace bslam::tracking
