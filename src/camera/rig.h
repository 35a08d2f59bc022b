// The rig: cameras and their constant extrinsics. Its frame is camera 0 (the paper's camera 1), so T_cam_rig of camera
// 0 is the identity; the paper's T_i1 is T_cam_rig of camera i, and c_i = T_i1 c_1 is cam_from_rig(i) * T_rig_world.
#pragma once

#include <memory>
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

// Immutable once made; copies share what does not differ between them.
class Rig {
 public:
  // At least one camera; the first is camera 0.
  explicit Rig(std::vector<RigCamera> cameras);

  std::size_t size() const { return T_cam_rig_.size(); }
  const Camera& camera(CameraIndex i) const { return calibration_->cameras[i.index()].camera; }
  const Camera& camera(std::size_t i) const { return calibration_->cameras[i].camera; }

  // T_cam_rig: maps rig (= camera 0) coordinates to those of camera i. Constant, as in the paper.
  const geometry::SE3& cam_from_rig(std::size_t i) const { return T_cam_rig_[i]; }
  const geometry::SE3& cam_from_rig(CameraIndex i) const { return T_cam_rig_[i.index()]; }
  const geometry::SE3& rig_from_cam(std::size_t i) const { return T_rig_cam_[i]; }

  // Body frame: input and output only.
  const geometry::SE3& body_from_cam(std::size_t i) const { return calibration_->cameras[i].T_body_cam; }

  // Do the views of cameras i and j share directions at some depth between near and far? Sampled from the calibration.
  bool overlap(std::size_t i, std::size_t j) const { return overlap_share(i, j) > kMinOverlap; }
  // Share of camera i's image that camera j sees, best over the sampled depths, in [0, 1].
  double overlap_share(std::size_t i, std::size_t j) const { return calibration_->overlap[i * size() + j]; }
  // True where some pair of cameras overlaps, so that a still rig sees metric depth. `left_out`: one per camera, those
  // that do not count; or empty.
  bool any_overlap(std::span<const std::uint8_t> left_out = {}) const;

  // The rig of some of the cameras, in the order given; the first becomes camera 0. Indices are valid and distinct.
  Rig subset(std::span<const int> indices) const;
  // The reverse: this rig with the extrinsics (T_body_cam) that its cameras `indices` have as the cameras of `part`.
  Rig with_extrinsics_of(const Rig& part, std::span<const int> indices) const;

  // The rig as it stands while its cameras fire one after the other: camera i, `delay_s[i]` after the rig's own
  // instant, has moved with the rig by exp(delay twist), so that T_cam_rig is T_i0 exp(delay twist) and the rig's pose
  // is that of its own instant. `twist`: T_rig_world(t + dt) = exp(dt twist) T_rig_world(t), rad/s and m/s. Cheap.
  Rig moving(std::span<const double> delay_s, const geometry::Vector6d& twist) const;

 private:
  static constexpr double kMinOverlap = 0.05;  // of the image: less is not worth a search
  struct Calibration {
    std::vector<RigCamera> cameras;
    std::vector<double> overlap;  // (N, N) row-major
  };
  std::vector<double> measured_overlap(const std::vector<RigCamera>& cameras) const;

  std::shared_ptr<const Calibration> calibration_;
  std::vector<geometry::SE3> T_cam_rig_, T_rig_cam_;
};

}  // namespace bslam::camera
