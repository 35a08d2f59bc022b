#include "map_export/landmark_information.h"

#include <Eigen/Cholesky>
#include <limits>
#include <vector>

#include "adjustment/landmark_keypoints.h"
#include "solver/reprojection.h"

namespace bslam::map_export {
namespace {

// The keypoints of selected keyframes that observe the landmark.
std::vector<adjustment::LandmarkKeypoint> keypoints_of(const Selection& selection, LandmarkId l) {
  const map::BundledMap& map = *selection.map;
  const auto selected = [&](KeyframeId k) { return selection.selected[k.index()] != 0; };
  std::vector<adjustment::LandmarkKeypoint> out;
  adjustment::landmark_keypoints(map, l, selected, {.pyramid = map.pyramid()}, out);
  return out;
}

// Zero if the landmark does not project.
Eigen::Matrix3d information_of(const map::BundledMap& map, LandmarkId l, const adjustment::LandmarkKeypoint& k) {
  const geometry::SE3 T_cam_world = map.cam_from_world(k.keyframe, k.keypoint);
  const auto residual = solver::residual(map.rig().camera(k.keypoint.camera).model,
                                         T_cam_world * map.landmark(l).position, k.pixel.cast<double>());
  if (!residual) return Eigen::Matrix3d::Zero();
  const Eigen::Matrix<double, 2, 3> J = residual->J * T_cam_world.matrix3() / double{k.sigma};
  return J.transpose() * J;
}

}  // namespace

std::pair<Eigen::Matrix3d, Eigen::Matrix3d> landmark_information(const Selection& selection, LandmarkId l, KeyframeId i,
                                                                 KeyframeId j) {
  Eigen::Matrix3d of_i = Eigen::Matrix3d::Zero(), of_j = Eigen::Matrix3d::Zero();
  for (const adjustment::LandmarkKeypoint& k : keypoints_of(selection, l)) {
    if (k.keyframe == i) of_i += information_of(*selection.map, l, k);
    if (k.keyframe == j) of_j += information_of(*selection.map, l, k);
  }
  return {of_i, of_j};
}

Eigen::Matrix3d landmark_covariance(const Selection& selection, LandmarkId l) {
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  for (const adjustment::LandmarkKeypoint& k : keypoints_of(selection, l))
    information += information_of(*selection.map, l, k);
  const Eigen::LDLT<Eigen::Matrix3d> ldlt(information);
  const bool determined = ldlt.info() == Eigen::Success && ldlt.vectorD().minCoeff() > 0;
  if (!determined) return Eigen::Matrix3d::Constant(std::numeric_limits<double>::infinity());
  return ldlt.solve(Eigen::Matrix3d::Identity());
}

}  // namespace bslam::map_export
