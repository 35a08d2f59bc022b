#include "geometry/so3.h"

#include <cmath>

namespace bslam::geometry {
namespace {

constexpr double kSmallAngle = 1e-4;  // below this angle the truncated series are exact to double precision

}  // namespace

Matrix3d skew(const Vector3d& v) {
  Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

Quaterniond so3_exp(const Vector3d& omega) {
  const double angle = omega.norm();
  // sin(angle / 2) / angle
  const double scale = angle < kSmallAngle ? 0.5 - angle * angle / 48.0 : std::sin(0.5 * angle) / angle;
  Quaterniond q(std::cos(0.5 * angle), scale * omega.x(), scale * omega.y(), scale * omega.z());
  q.normalize();
  return q;
}

Vector3d so3_log(const Quaterniond& q) {
  // q and -q are the same rotation; this selects the one with the smaller angle
  const double sign = q.w() < 0 ? -1.0 : 1.0;
  const double sine = q.vec().norm();
  const double cosine = sign * q.w();
  const double scale = sine < 0.5 * kSmallAngle ? 2.0 / cosine * (1.0 - sine * sine / (3.0 * cosine * cosine))
                                                : 2.0 * std::atan2(sine, cosine) / sine;
  return sign * scale * q.vec();
}

Matrix3d so3_left_jacobian(const Vector3d& omega) {
  const double a2 = omega.squaredNorm();
  const double a = std::sqrt(a2);
  const Matrix3d W = skew(omega);
  const double b = a < kSmallAngle ? 0.5 - a2 / 24.0 : (1.0 - std::cos(a)) / a2;
  const double c = a < kSmallAngle ? 1.0 / 6.0 - a2 / 120.0 : (a - std::sin(a)) / (a2 * a);
  return Matrix3d::Identity() + b * W + c * W * W;
}

Matrix3d so3_left_jacobian_inverse(const Vector3d& omega) {
  const double a2 = omega.squaredNorm();
  const double a = std::sqrt(a2);
  const Matrix3d W = skew(omega);
  const double c = a < 1e-3 ? 1.0 / 12.0 + a2 / 720.0 : 1.0 / a2 - 0.5 / (a * std::tan(0.5 * a));
  return Matrix3d::Identity() - 0.5 * W + c * W * W;
}

}  // namespace bslam::geometry
