#include "map_export/landmark_information.h"

#include <Eigen/Cholesky>
#include <limits>

#include "adjustment/landmark_keypoints.h"
#include "solver/reprojection.h"

namespace bslam::map_export {
namespace {

// The sum over the keypoints of selected keyframes that are `wanted`.
template <class Wanted>
Eigen::Matrix3d information_of(const Selection& selection, LandmarkId l, const Wanted& wanted) {
  const map::BundledMap& map = *selection.map;
  const auto selected = [&](KeyframeId k) { return selection.selected[k.index()] != 0; };
  std::vector<adjustment::LandmarkKeypoint> keypoints;
  adjustment::landmark_keypoints(map, l, selected, {.pyramid = map.pyramid()}, keypoints);
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (const adjustment::LandmarkKeypoint& k : keypoints) {
    if (!wanted(k.keyframe)) continue;
    const geometry::SE3 T_cam_world = map.cam_from_world(k.keyframe, k.keypoint);
    const auto residual = solver::residual(map.rig().camera(k.keypoint.camera).model,
                                           T_cam_world * map.landmark(l).position, k.pixel.cast<double>());
    if (!residual) continue;
    const Eigen::Matrix<double, 2, 3> J = residual->J * T_cam_world.matrix3() / double{k.sigma};
    sum += J.transpose() * J;
  }
  return sum;
}

}  // namespace

Eigen::Matrix3d landmark_information(const Selection& selection, LandmarkId l, KeyframeId k) {
  return information_of(selection, l, [&](KeyframeId other) { return other == k; });
}

Eigen::Matrix3d landmark_covariance(const Selection& selection, LandmarkId l) {
  const Eigen::Matrix3d information = information_of(selection, l, [](KeyframeId) { return true; });
  const Eigen::LDLT<Eigen::Matrix3d> ldlt(information);
  const bool determined = ldlt.info() == Eigen::Success && ldlt.vectorD().minCoeff() > 0;
  if (!determined) return Eigen::Matrix3d::Constant(std::numeric_limits<double>::infinity());
  return ldlt.solve(Eigen::Matrix3d::Identity());
}

}  // namespace bslam::map_export
