// The uncertainty of a pose T: that of the left perturbation delta with T_true = exp(delta) T, rotation (rad) first,
// then translation.
#pragma once

#include "geometry/se3.h"

namespace bslam::geometry {

struct PoseUncertainty {
  using Effect = Eigen::Matrix<double, 6, Eigen::Dynamic>;

  Matrix6d noise = Matrix6d::Zero();  // covariance of the error that the noise of the images causes
  // The error of the calibration causes delta = calibration z, where z ~ N(0, I) is the same for all poses. No columns
  // if the calibration is taken as exact.
  Effect calibration = Effect(6, 0);

  Matrix6d covariance() const { return noise + calibration * calibration.transpose(); }
};

// Sum of two effects of the same z; one without columns is zero.
inline PoseUncertainty::Effect sum(const PoseUncertainty::Effect& a, const PoseUncertainty::Effect& b) {
  if (a.cols() == 0) return b;
  return b.cols() == 0 ? a : PoseUncertainty::Effect(a + b);
}

// The uncertainty of a perturbation that is the sum of two. Their noise is independent.
inline PoseUncertainty operator+(const PoseUncertainty& a, const PoseUncertainty& b) {
  return {a.noise + b.noise, sum(a.calibration, b.calibration)};
}

// The uncertainty if the calibration is taken as exact after all.
inline PoseUncertainty without_calibration(const PoseUncertainty& uncertainty) { return {uncertainty.noise}; }

// The uncertainty of T_b_a T_a, where T_a has this uncertainty and T_b_a is exact.
inline PoseUncertainty transported(const PoseUncertainty& uncertainty, const SE3& T_b_a) {
  const Matrix6d A = T_b_a.adjoint();
  return {A * uncertainty.noise * A.transpose(), A * uncertainty.calibration};
}

// The uncertainty after all lengths were multiplied by `factor`.
inline PoseUncertainty scaled(PoseUncertainty uncertainty, double factor) {
  uncertainty.noise.rightCols<3>() *= factor;
  uncertainty.noise.bottomRows<3>() *= factor;
  uncertainty.calibration.bottomRows<3>() *= factor;
  return uncertainty;
}

}  // namespace bslam::geometry
