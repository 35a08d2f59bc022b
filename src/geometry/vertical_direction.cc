#include "geometry/vertical_direction.h"

#include <Eigen/SVD>

namespace bslam::geometry {

Vector3d vertical_direction(std::span<const SE3> T_world_rig) {
  constexpr double kAlmostAsConstant = 0.9;
  const Vector3d up_rig(0, -1, 0);  // y points downward in an image
  if (T_world_rig.empty()) return up_rig;
  Matrix3d mean = Matrix3d::Zero();
  for (const SE3& T : T_world_rig) mean += T.matrix3() / static_cast<double>(T_world_rig.size());
  const Eigen::JacobiSVD<Matrix3d> svd(mean, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Vector3d mean_up = mean * up_rig;
  if (mean_up.norm() >= kAlmostAsConstant * svd.singularValues()[0]) return mean_up.normalized();
  const Vector3d most_constant = svd.matrixU().col(0);
  return svd.matrixV().col(0).dot(up_rig) < 0 ? Vector3d(-most_constant) : most_constant;
}

SE3 upright_axes(std::span<const SE3> T_world_rig) {
  return upright_axes(T_world_rig, vertical_direction(T_world_rig));
}

SE3 upright_axes(std::span<const SE3> T_world_rig, const Vector3d& up) {
  constexpr double kSteep = 0.2;  // horizontal part of a unit vector: 12 degrees from the vertical
  const Matrix3d first = T_world_rig.empty() ? Matrix3d::Identity() : T_world_rig.front().matrix3();
  Vector3d forward = first.col(2) - up.dot(first.col(2)) * up;
  if (forward.norm() < kSteep) forward = first.col(0) - up.dot(first.col(0)) * up;
  forward.normalize();
  Matrix3d R;  // its rows are the new axes in the world
  R << forward.transpose(), up.cross(forward).transpose(), up.transpose();
  return {R, Vector3d::Zero()};
}

}  // namespace bslam::geometry
