#include "calibration/rig_frame.h"

#include <Eigen/SVD>
#include <utility>
#include <vector>

namespace bslam::calibration {

using geometry::SE3;

SE3 turn_of_rays(const camera::Camera& refined, const camera::Camera& calibrated) {
  constexpr int kColumns = 24, kRows = 16;
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (int r = 0; r < kRows; ++r) {
    for (int c = 0; c < kColumns; ++c) {
      const Eigen::Vector2d pixel((c + 0.5) * refined.width / kColumns - 0.5, (r + 0.5) * refined.height / kRows - 0.5);
      const auto after = refined.unproject(pixel), before = calibrated.unproject(pixel);
      if (after && before) sum += *after * before->transpose();
    }
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d U = svd.matrixU();
  if (U.determinant() * svd.matrixV().determinant() < 0) U.col(2) *= -1;
  return SE3(Eigen::Quaterniond(U * svd.matrixV().transpose()), Eigen::Vector3d::Zero());
}

void move_to_rig_frame(const SE3& T_cam0_rig, const SE3& before, RigProblem& problem) {
  std::vector<SE3>& poses = problem.selected.problem.T_rig_world;
  const SE3 turn = T_cam0_rig * before.inverse();
  std::vector<SE3> T_old_new(poses.size());  // per group, at the index of its fixed keyframe: the world
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (problem.group[i] == i) T_old_new[i] = poses[i].inverse() * turn * poses[i];
  }
  const SE3 T_rig_cam0 = T_cam0_rig.inverse();
  for (std::size_t i = 0; i < poses.size(); ++i) poses[i] = T_rig_cam0 * poses[i] * T_old_new[problem.group[i]];
  int last = -1;
  for (const auto& o : problem.selected.problem.observations) {
    if (std::exchange(last, o.point) == o.point) continue;
    Eigen::Vector3d& point = problem.selected.problem.points[static_cast<std::size_t>(o.point)];
    point = T_old_new[problem.group[static_cast<std::size_t>(o.pose)]].inverse() * point;
  }
}

camera::Rig with_rig_frame(const camera::Rig& rig, const SE3& T_cam0_rig, const SE3& T_body_rig) {
  std::vector<camera::RigCamera> cameras;
  for (std::size_t c = 0; c < rig.size(); ++c) {
    const SE3 T_cam_rig = rig.cam_from_rig(c) * T_cam0_rig;
    cameras.push_back({rig.camera(c), T_body_rig * T_cam_rig.inverse()});
  }
  return camera::Rig(std::move(cameras), T_cam0_rig);
}

}  // namespace bslam::calibration
