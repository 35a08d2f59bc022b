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

// The length of the part of a change in directions whose standard deviation is at least `ratio` times that of the
// prior: eigenvectors of the covariance after division by a square root of the prior's.
inline double unobserved_length(const Eigen::Vector3d& change, const Eigen::Matrix3d& covariance,
                                const Eigen::Matrix3d& prior, double ratio) {
  const Eigen::LLT<Eigen::Matrix3d> factor(prior);
  const Eigen::Matrix3d half = factor.matrixL().solve(covariance), relative = factor.matrixL().solve(half.transpose());
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> directions(relative);
  const Eigen::Vector3d parts = directions.eigenvectors().transpose() * factor.matrixL().solve(change);
  Eigen::Vector3d unobserved = Eigen::Vector3d::Zero();
  for (int k = 0; k < 3; ++k) {
    if (directions.eigenvalues()(k) >= ratio * ratio) unobserved += parts(k) * directions.eigenvectors().col(k);
  }
  return (factor.matrixL() * unobserved).norm();
}

}  // namespace bslam::calibration
