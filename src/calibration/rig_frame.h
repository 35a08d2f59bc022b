// The rig frame of a refined calibration. An estimate that moves the principal point of camera 0 rotates the camera
// frame relative to the rays of the pixels, by about a degree on some real rigs. The calibrated T_body_cam and the
// poses reported so far refer to the rays. The rig frame therefore keeps its orientation relative to the rays, and
// camera 0 is rotated in the rig frame. This assumes that the extrinsics absorbed the error of the principal point when
// they were calibrated, as a fit to a target does.
#pragma once

#include "calibration/rig_problem.h"
#include "camera/rig.h"

namespace bslam::calibration {

// The rotation that fits the rays of camera 0 best: ray of `refined` = T * ray of `calibrated`, over all pixels.
geometry::SE3 turn_of_rays(const camera::Camera& refined, const camera::Camera& calibrated);

// Changes poses and points of an adjusted problem from the frame of camera 0 to the rig frame T_cam0_rig. Each group is
// turned as a whole, about its fixed keyframe. `before`: T_cam0_rig of the map from which the problem was chosen.
void move_to_rig_frame(const geometry::SE3& T_cam0_rig, const geometry::SE3& before, RigProblem& problem);

// Returns `rig`, whose rig frame is the frame of camera 0, with its rig frame moved to T_body_rig.
camera::Rig with_rig_frame(const camera::Rig& rig, const geometry::SE3& T_cam0_rig, const geometry::SE3& T_body_rig);

}  // namespace bslam::calibration
