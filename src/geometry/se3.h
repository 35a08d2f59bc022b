// Rigid transforms SE(3). T_a_b maps coordinates in b to coordinates in a: p_a = T_a_b * p_b.
#pragma once

#include "geometry/so3.h"

namespace bslam::geometry {

class SE3 {
 public:
  SE3() = default;  // identity
  SE3(const Quaterniond& rotation, const Vector3d& translation)
      : rotation_(rotation.normalized()), translation_(translation) {}
  SE3(const Matrix3d& rotation, const Vector3d& translation) : SE3(Quaterniond(rotation), translation) {}

  const Quaterniond& rotation() const { return rotation_; }
  const Vector3d& translation() const { return translation_; }
  Matrix3d matrix3() const { return rotation_.toRotationMatrix(); }
  Eigen::Matrix4d matrix() const;

  SE3 inverse() const;
  SE3 operator*(const SE3& other) const;
  Vector3d operator*(const Vector3d& point) const { return rotation_ * point + translation_; }

  // Tangent vectors are [omega, v], rotation first. Perturbation is on the left: T <- exp(delta) * T.
  static SE3 exp(const Vector6d& xi);
  Vector6d log() const;
  SE3 perturbed(const Vector6d& delta) const { return exp(delta) * *this; }

  // Adjoint matrix Ad of this transform T: T exp(xi) T^-1 = exp(Ad xi).
  Matrix6d adjoint() const;

 private:
  Quaterniond rotation_ = Quaterniond::Identity();
  Vector3d translation_ = Vector3d::Zero();
};

// Returns T with its translation multiplied by `factor`.
inline SE3 scaled(const SE3& T, double factor) { return {T.rotation(), factor * T.translation()}; }
// The same for a tangent vector, such as a twist: multiplies its translational part.
inline Vector6d scaled(const Vector6d& xi, double factor) {
  Vector6d out = xi;
  out.tail<3>() *= factor;
  return out;
}

// Returns the pose on the geodesic from `a` (fraction 0) to `b` (fraction 1). Fractions outside [0, 1] extrapolate.
SE3 interpolate(const SE3& a, const SE3& b, double fraction);

}  // namespace bslam::geometry
