#include "geometry/se3.h"

namespace bslam::geometry {

Eigen::Matrix4d SE3::matrix() const {
  Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
  m.topLeftCorner<3, 3>() = matrix3();
  m.topRightCorner<3, 1>() = translation_;
  return m;
}

SE3 SE3::inverse() const {
  const Quaterniond r = rotation_.conjugate();
  return SE3(r, -(r * translation_));
}

SE3 SE3::operator*(const SE3& other) const {
  return SE3(rotation_ * other.rotation_, rotation_ * other.translation_ + translation_);
}

SE3 SE3::exp(const Vector6d& xi) {
  const Vector3d omega = xi.head<3>();
  return SE3(so3_exp(omega), so3_left_jacobian(omega) * xi.tail<3>());
}

Vector6d SE3::log() const {
  Vector6d xi;
  xi.head<3>() = so3_log(rotation_);
  xi.tail<3>() = so3_left_jacobian_inverse(xi.head<3>()) * translation_;
  return xi;
}

Matrix6d SE3::adjoint() const {
  const Matrix3d R = matrix3();
  Matrix6d ad = Matrix6d::Zero();
  ad.topLeftCorner<3, 3>() = R;
  ad.bottomRightCorner<3, 3>() = R;
  ad.bottomLeftCorner<3, 3>() = skew(translation_) * R;
  return ad;
}

SE3 interpolate(const SE3& a, const SE3& b, double fraction) {
  return SE3::exp(fraction * (b * a.inverse()).log()) * a;
}

}  // namespace bslam::geometry
