// Cameras that were moved relative to the rig during a recording, because they were hit or their mounts slipped.
#pragma once

#include <vector>

#include "calibration/rig_bundle_adjustment.h"
#include "calibration/rig_problem.h"

namespace bslam::calibration {

// A change of the extrinsics of a camera of a problem between two keyframes.
struct PossibleMove {
  std::size_t camera = 0;  // of the problem
  std::size_t pose = 0;    // of the problem: the first one after the move
  // If poses, points and other cameras stay as they are: the change of the extrinsics (a left perturbation of
  // T_cam_rig, rad and metres), and twice the decrease of the cost.
  geometry::Vector6d change = geometry::Vector6d::Zero();
  double chi2 = 0;
};

// The cameras of a rig problem: the N cameras of the rig, then one for each move. Camera N + m has the observations of
// the camera of move m, from the move to the next one of this camera, its intrinsics and its timing; its extrinsics are
// independent. Without moves all functions leave their arguments as they are.
class MovedCameras {
 public:
  // `moves`: in order of time.
  MovedCameras(std::size_t cameras, std::vector<camera::CameraMove> moves);

  const std::vector<camera::CameraMove>& moves() const { return moves_; }
  // The camera of the problem that a camera of the rig is just before move m.
  std::size_t before(std::size_t m) const;
  // The camera of the rig that a camera of the problem is.
  std::size_t camera_of_rig(std::size_t camera) const {
    return camera < cameras_ ? camera : moves_[camera - cameras_].camera;
  }

  // Adds the cameras to a rig without moves, whose rig frame is that of camera 0, with the extrinsics before the moves;
  // to the values of a rig, with the extrinsics after them; and to options of an adjustment.
  camera::Rig added_to(const camera::Rig& rig) const;
  solver::RigValues added_to(solver::RigValues values) const;
  RigAdjustmentOptions added_to(RigAdjustmentOptions options) const;
  // The values of the N cameras, and the moves that all values show.
  solver::RigValues of_rig(solver::RigValues values) const;
  std::vector<camera::CameraMove> moves_of(const solver::RigValues& values) const;
  // The information about the N cameras, with the extrinsics of the others marginalised out.
  RigInformation of_rig(const RigInformation& information) const;

  // Two forms of one problem. After separate(), which the adjustment needs, the images of a camera after a move are
  // those of the added camera, which has extrinsics of its own. After join(), which the search for observations needs,
  // they are those of the camera of the rig again, with its extrinsics before the moves; instead, the motion of the rig
  // (ReprojectionProblem::motion) for these images contains the move that `values` show.
  void separate(const map::BundledMap& map, RigProblem& problem) const;
  void join(const map::BundledMap& map, const solver::RigValues& values, RigProblem& problem) const;

  // The most likely further move of each camera of the problem, whether it happened or not, if it has enough
  // observations before and after a keyframe. `values`: the optimum for constant extrinsics. There the derivative of
  // the cost with respect to the extrinsics of a camera is zero, but if the camera moved, those of the parts before and
  // after the move have opposite signs (docs/math.md, section 16).
  // Only moves at `from` or later count.
  std::vector<PossibleMove> likely_moves(const map::BundledMap& map, const RigProblem& problem,
                                         const solver::RigValues& values, TimeNs from) const;
  // The moves that the values show, each before the keyframe for which its extrinsics before and after it fit best;
  // without those at the ends, of which too few images are on one side.
  std::vector<camera::CameraMove> at_best_times(const map::BundledMap& map, const RigProblem& problem,
                                                const solver::RigValues& values) const;
  // The moves that the values show, and a further one, which begins without a change of the extrinsics.
  MovedCameras with_move(const solver::RigValues& values, const PossibleMove& move, TimeNs time_ns) const;

 private:
  std::size_t camera_at(std::size_t camera, TimeNs time_ns) const;  // the camera of the problem

  std::size_t cameras_;
  std::vector<camera::CameraMove> moves_;
};

}  // namespace bslam::calibration
