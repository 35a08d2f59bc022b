// Metric motion of a rig between two frames from matches within each of its cameras. The motion of the reference camera
// is known up to scale; the positions of the other cameras on the rig determine the scale if the rig rotates
// (generalised epipolar constraint; Pless, "Using many cameras as one", CVPR 2003).
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "estimators/relative_pose.h"

namespace bslam::estimators {

// Matches of one camera of the rig between the frames a and b; they may contain outliers.
struct CameraPairs {
  geometry::SE3 T_cam_ref;  // the identity for the reference camera
  std::vector<BearingPair> pairs;
  double inlier_angle = 2e-3;  // rad, maximum angle between a bearing and the epipolar plane of the other
};

struct GeneralisedScaleOptions {
  double shortest = 0.005, longest = 5.0;  // metres, range of the translation of the reference
};

struct GeneralisedScale {
  geometry::SE3 T_b_a;     // reference camera, metres
  double deviation = 0.0;  // relative standard deviation of the distance
};

// `T_b_a`: motion of the reference, with a translation of any length. Refines rotation and translation together, so
// that the deviation includes the uncertainty of the direction of motion, starting from distances over the whole range;
// it is that of the residuals of the inliers, or the difference to another minimum of the cost that they do not
// exclude. Returns nullopt if the distance is not observable: one camera, all cameras at one position, or a motion
// without rotation.
std::optional<GeneralisedScale> generalised_scale(const geometry::SE3& T_b_a, std::span<const CameraPairs> cameras,
                                                  const GeneralisedScaleOptions& options = {});

}  // namespace bslam::estimators
