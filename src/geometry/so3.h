// The rotation group SO(3): exponential, logarithm and their Jacobians. Angles in radians. Equations: docs/math.md.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <numbers>

namespace bslam::geometry {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

// Conversions for input and output.
constexpr double degrees(double radians) { return radians * 180.0 / std::numbers::pi; }
constexpr double radians(double degrees) { return degrees * std::numbers::pi / 180.0; }

// Returns the skew-symmetric matrix [v]x, so that skew(v) * w = v x w.
Matrix3d skew(const Vector3d& v);

// Exponential map: rotation vector to unit quaternion, accurate near zero as well.
Quaterniond so3_exp(const Vector3d& omega);

// Logarithm: unit quaternion to rotation vector with norm in [0, pi].
Vector3d so3_log(const Quaterniond& q);

// Left Jacobian J_l of SO(3), exp(omega + d) ~ exp(J_l(omega) d) exp(omega), and its inverse.
Matrix3d so3_left_jacobian(const Vector3d& omega);
Matrix3d so3_left_jacobian_inverse(const Vector3d& omega);

}  // namespace bslam::geometry
