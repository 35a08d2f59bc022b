// The rotation by which the view of a camera differs from the predicted one. The calibration of a camera may be wrong
// by so much that none of its keypoints is where the pose of the rig predicts it, although the camera sees the right
// scene.
#pragma once

#include <Eigen/Core>
#include <span>

#include "tracking/frame_matches.h"

namespace bslam::tracking {

// Unit vectors in the frame of a camera.
struct DirectionPair {
  Eigen::Vector3d predicted, observed;
};

struct ViewRotation {
  double angle = 0;  // rad
  int agree = 0;     // number of pairs that agree with the rotation to 0.01 rad
};

// The rotation of a camera about its centre that most pairs agree with, if it is at most some degrees.
ViewRotation view_rotation(std::span<const DirectionPair> pairs);

// Returns true if a rotation of camera c by no more than the calibration may be wrong explains its matches. Matches in
// images of another scene, or of a camera at another place, do not agree with a rotation.
bool rotated_view(const map::BundledMap& map, const frame::BundledFrame& frame, std::size_t c,
                  const geometry::SE3& T_rig_world, std::span<const Match> matches, const ConsensusOptions& options);

}  // namespace bslam::tracking
