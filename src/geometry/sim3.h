// Similarity transforms Sim(3): p_a = s R p_b + t for T_a_b, which maps b to a as for SE3. Equations: docs/math.md,
// section 1.
#pragma once

#include "geometry/se3.h"

namespace bslam::geometry {

using Vector7d = Eigen::Matrix<double, 7, 1>;
using Matrix7d = Eigen::Matrix<double, 7, 7>;

class Sim3 {
 public:
  Sim3() = default;  // identity
  Sim3(double scale, const Quaterniond& rotation, const Vector3d& translation)
      : scale_(scale), rotation_(rotation.normalized()), translation_(translation) {}
  explicit Sim3(const SE3& rigid) : Sim3(1.0, rigid.rotation(), rigid.translation()) {}

  double scale() const { return scale_; }
  const Quaterniond& rotation() const { return rotation_; }
  const Vector3d& translation() const { return translation_; }

  Sim3 inverse() const;
  Sim3 operator*(const Sim3& other) const;
  Vector3d operator*(const Vector3d& point) const { return scale_ * (rotation_ * point) + translation_; }

  // Tangent vectors are [omega, v, log scale]. Perturbation is on the left: S <- exp(delta) * S. exp and log are exact
  // to rounding for scales between 1/100 and 100. With a log scale of 0 they equal those of SE3, and the scale is
  // exactly 1.
  static Sim3 exp(const Vector7d& xi);
  Vector7d log() const;
  Sim3 perturbed(const Vector7d& delta) const { return exp(delta) * *this; }

  // Adjoint matrix Ad of this transform S: S exp(xi) S^-1 = exp(Ad xi).
  Matrix7d adjoint() const;

  // Transforms a pose by the similarity and drops the scale: returns the rigid pose of the frame in the transformed
  // world.
  SE3 apply_to_pose(const SE3& T_b_frame) const {
    return SE3(rotation_ * T_b_frame.rotation(), *this * T_b_frame.translation());
  }

 private:
  double scale_ = 1.0;
  Quaterniond rotation_ = Quaterniond::Identity();
  Vector3d translation_ = Vector3d::Zero();
};

}  // namespace bslam::geometry
