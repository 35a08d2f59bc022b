// The rig: cameras and their constant extrinsics. Its frame is camera 0 (the paper's camera 1), so T_cam_rig of camera 0
// is the identity; the paper's T_i1 is T_cam_rig of camera i, and c_i = T_i1 c_1 is cam_from_rig(i) * T_rig_world.
#pragma once

#include <span>
#include <vector>

#include "base/id.h"
#include "base/result.h"
#include "camera/camera.h"
#include "geometry/se3.h"

namespace bslam::camera {

struct RigCamera {
  Camera camera;
  geometry::SE3 T_body_cam;  // as calibrated
};

// Immutable once made.
class Rig {
 public:
  // At least one camera; the first is camera 0.
  explicit Rig(std::vector<RigCamera> cameras);

  std::size_t size() const { return cameras_.size(); }
  const Camera& camera(CameraIndex i) const { return cameras_[i.index()].camera; }
  const Camera& camera(std::size_t i) const { return cameras_[i].camera; }

  // T_cam_rig: maps rig (= camera 0) coordinates to those of camera i. Constant, as in the paper.
  const geometry::SE3& cam_from_rig(std::size_t i) const { return T_cam_rig_[i]; }
  const geometry::SE3& cam_from_rig(CameraIndex i) const { return T_cam_rig_[i.index()]; }
  const geometry::SE3& rig_from_cam(std::size_t i) const { return T_rig_cam_[i]; }

  // Body frame: input and output only.
  const geometry::SE3& body_from_cam(std::size_t i) const { return cameras_[i].T_body_cam; }

  // Do the views of cameras i and j share directions at some depth between near and far? Sampled from the calibration.
  bool overlap(std::size_t i, std::size_t j) const { return overlap_[i * size() + j] > kMinOverlap; }
  // Share of camera i's image that camera j sees, best over the sampled depths, in [0, 1].
  double overlap_share(std::size_t i, std::size_t j) const { return overlap_[i * size() + j]; }
  // True where some pair of cameras overlaps, so that a still rig sees metric depth.
  bool any_overlap() const;

  // The rig of some of the cameras, in the order given; the first becomes camera 0. Indices are valid and distinct.
  Rig subset(std::span<const int> indices) const;

 private:
  static constexpr double kMinOverlap = 0.05;  // of the image: less is not worth a search
  void measure_overlap();

  std::vector<RigCamera> cameras_;
  std::vector<geometry::SE3> T_cam_rig_, T_rig_cam_;
  std::vector<double> overlap_;  // (N, N) row-major
};

}  // namespace bslam::camera
