// Compares a motion of the rig with all keypoints of the images, including those that are not landmarks. A new map has
// landmarks only at points whose distance a single frame determines. These are near the rig, where people may walk.
#pragma once

#include <span>
#include <vector>

#include "estimators/relative_pose.h"
#include "tracking/track.h"

namespace bslam::tracking {

// Keypoints of a frame that look like keypoints of the same camera in a keyframe, in all cameras.
class SceneMatches {
 public:
  // `observations`: observations of landmarks in the frame; their median distance determines the minimum distance of a
  // point.
  SceneMatches(const TrackInput& input, const frame::BundledFrame& frame,
               std::span<const solver::PoseObservation> observations, const geometry::SE3& T_rig_world);

  // Number of cells of the grids of `support` (tracking/robust_pose.h) in which most of the matches agree with the
  // pose: the point may have any distance from a tenth of the median one to infinity. If the rig does not rotate,
  // points that move with the rig look like points at infinity and agree with any translation, but static points
  // contradict a pose that follows them. Excluded cameras have no matches.
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
