#include "map_export/landmark_information.h"

#include <Eigen/Cholesky>
#include <limits>

namespace bslam::map_export {

Eigen::Matrix3d keypoint_information(const map::BundledMap& map, KeyframeId k, LandmarkId l, FeatureId f) {
  const Eigen::Vector3d& p = map.landmark(l).position;
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (const frame::KeypointRef r : map.keyframe(k).frame->bundled.keypoints(f)) {
    const geometry::SE3 T_cam_world = map.cam_from_world(k, r);
    const auto projection = map.rig().camera(r.camera).project_with_jacobian(T_cam_world * p);
    if (!projection) continue;
    const double sigma = map.keypoints(k, r.camera).sigma[r.keypoint.index()];
    const Eigen::Matrix<double, 2, 3> J = projection->jacobian * T_cam_world.matrix3() / sigma;
    sum += J.transpose() * J;
  }
  return sum;
}

Eigen::Matrix3d landmark_covariance(const Selection& selection, LandmarkId l) {
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  for (const map::Observation& o : selection.map->observations(l)) {
    if (selection.selected[o.keyframe.index()])
      information += keypoint_information(*selection.map, o.keyframe, l, o.feature);
  }
  const Eigen::LDLT<Eigen::Matrix3d> ldlt(information);
  const bool determined = ldlt.info() == Eigen::Success && ldlt.vectorD().minCoeff() > 0;
  if (!determined) return Eigen::Matrix3d::Constant(std::numeric_limits<double>::infinity());
  return ldlt.solve(Eigen::Matrix3d::Identity());
}

}  // namespace bslam::map_export
