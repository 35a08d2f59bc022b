// Metric motion of a rig between two frames, from matches within each of its cameras: one of them, the reference, knows
// its motion up to scale, and where the others are on the rig gives the scale where the rig turns (generalised epipolar
// constraint; Pless, "Using many cameras as one", CVPR 2003).
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "estimators/relative_pose.h"

namespace bslam::estimators {

// Matches of one camera of the rig between the frames a and b; outliers may be among them.
struct CameraPairs {
  geometry::SE3 T_cam_ref;  // identity for the reference itself
  std::vector<BearingPair> pairs;
};

struct GeneralisedScaleOptions {
  double shortest = 0.005, longest = 5.0;  // metres the reference may have moved
  double inlier_angle = 2e-3;              // radians between a bearing and the epipolar plane of the other
};

struct GeneralisedScale {
  geometry::SE3 T_b_a;     // reference camera, metres
  double deviation = 0.0;  // relative standard deviation of the distance, by the residuals of the inliers
  int num_inliers = 0;
};

// Tries distances all over the range along `T_b_a` (of the reference; only the direction of its translation counts),
// then refines rotation and translation together from the best, so that the deviation holds what the reference does not
// know of its motion. Empty where nothing tells the distance: one camera, all cameras in one place, a motion without
// rotation.
std::optional<GeneralisedScale> generalised_scale(const geometry::SE3& T_b_a, std::span<const CameraPairs> cameras,
                                                  const GeneralisedScaleOptions& options = {});

}  // namespace bslam::estimators
