#include "geometry/sim3.h"

#include <Eigen/LU>
#include <array>
#include <cmath>

namespace bslam::geometry {
namespace {

// Positive abscissae and weights of ten-point Gauss-Legendre quadrature on [-1, 1].
struct Node {
  double at, weight;
};
constexpr std::array<Node, 5> kNodes{{{0.14887433898163121, 0.29552422471475287},
                                      {0.43339539412924719, 0.26926671930999636},
                                      {0.67940956829902441, 0.21908636251598204},
                                      {0.86506336668898451, 0.14945134915058059},
                                      {0.97390652851717172, 0.06667134430868814}}};

// Returns the matrix V with exp([omega, v, log scale]) = (scale, exp(omega), V v): the integral of exp(x log scale)
// exp(x omega) over x from 0 to 1. The closed form suffers from cancellation if the angle or the log scale is small;
// the quadrature does not.
Matrix3d translation_jacobian(const Vector3d& omega, double log_scale) {
  if (log_scale == 0.0) return so3_left_jacobian(omega);
  Matrix3d V = Matrix3d::Zero();
  for (const Node& node : kNodes) {
    for (const double x : {0.5 - 0.5 * node.at, 0.5 + 0.5 * node.at}) {
      V += 0.5 * node.weight * std::exp(x * log_scale) * so3_exp(x * omega).toRotationMatrix();
    }
  }
  return V;
}

}  // namespace

Sim3 Sim3::inverse() const {
  const Quaterniond r = rotation_.conjugate();
  return Sim3(1.0 / scale_, r, -(r * translation_) / scale_);
}

Sim3 Sim3::operator*(const Sim3& other) const {
  return Sim3(scale_ * other.scale_, rotation_ * other.rotation_, *this * other.translation_);
}

Sim3 Sim3::exp(const Vector7d& xi) {
  const Vector3d omega = xi.head<3>();
  return Sim3(std::exp(xi(6)), so3_exp(omega), translation_jacobian(omega, xi(6)) * xi.segment<3>(3));
}

Vector7d Sim3::log() const {
  Vector7d xi;
  const Vector3d omega = so3_log(rotation_);
  xi(6) = std::log(scale_);
  xi.head<3>() = omega;
  xi.segment<3>(3) = xi(6) == 0.0 ? Vector3d(so3_left_jacobian_inverse(omega) * translation_)
                                  : Vector3d(translation_jacobian(omega, xi(6)).partialPivLu().solve(translation_));
  return xi;
}

Matrix7d Sim3::adjoint() const {
  const Matrix3d R = rotation_.toRotationMatrix();
  Matrix7d ad = Matrix7d::Zero();
  ad.block<3, 3>(0, 0) = R;
  ad.block<3, 3>(3, 0) = skew(translation_) * R;
  ad.block<3, 3>(3, 3) = scale_ * R;
  ad.block<3, 1>(3, 6) = -translation_;
  ad(6, 6) = 1.0;
  return ad;
}

}  // namespace bslam::geometry
