// Covariance of a pose T: of the left perturbation delta, rotation (rad) first, with T_true = exp(delta) T.
#pragma once

#include "geometry/se3.h"

namespace bslam::geometry {

// The covariance of T_b_a T_a, where T_a has this covariance and T_b_a is exact.
inline Matrix6d transported(const Matrix6d& covariance, const SE3& T_b_a) {
  const Matrix6d A = T_b_a.adjoint();
  return A * covariance * A.transpose();
}

// The covariance after all lengths were multiplied by `factor`.
inline Matrix6d scaled(const Matrix6d& covariance, double factor) {
  Matrix6d out = covariance;
  out.rightCols<3>() *= factor;
  out.bottomRows<3>() *= factor;
  return out;
}

}  // namespace bslam::geometry
