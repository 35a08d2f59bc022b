// Which motion of the rig agrees with the images as a whole, also where no landmarks are known yet. A map that was just
// started has landmarks only where a single frame tells their distance: near the rig, where people walk.
#pragma once

#include <span>
#include <vector>

#include "estimators/relative_pose.h"
#include "tracking/track.h"

namespace bslam::tracking {

// Keypoints of a frame that look like keypoints of the same camera in a keyframe, in all cameras.
class SceneMatches {
 public:
  // `observations`: of landmarks in the frame; their median distance tells how near a point may be.
  SceneMatches(const TrackInput& input, const frame::BundledFrame& frame,
               std::span<const solver::PoseObservation> observations, const geometry::SE3& T_rig_world);

  // Number of cells of the grids of `support` (tracking/robust_pose.h) in which most of the matches agree with the
  // pose: the point may have any distance from a tenth of the median one to infinity. While the rig does not turn,
  // what moves with it looks like points at infinity and agrees with any translation; other points contradict a pose
  // that follows it. Excluded cameras have no matches.
  int agreeing_cells(const geometry::SE3& T_rig_world) const;

 private:
  struct Pair {
    std::size_t camera, cell;
    estimators::BearingPair bearings;  // in the keyframe and in the frame
    double tolerance;                  // rad
  };

  std::vector<geometry::SE3> T_rig_camera_before_, T_camera_rig_;  // in the keyframe and in the frame
  geometry::SE3 T_world_keyframe_;
  double nearest_ = 0.0;
  std::vector<Pair> pairs_;
};

}  // namespace bslam::tracking
