// How large a change is compared with its covariance.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <cmath>

namespace bslam::calibration {

// The standard deviation in the direction where it is largest.
inline double largest_deviation(const Eigen::Matrix3d& covariance) {
  return std::sqrt(
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(covariance, Eigen::EigenvaluesOnly).eigenvalues().maxCoeff());
}

// The number of standard deviations.
inline double mahalanobis_distance(const Eigen::Vector3d& change, const Eigen::Matrix3d& covariance) {
  return std::sqrt(change.dot(covariance.llt().solve(change)));
}

}  // namespace bslam::calibration
