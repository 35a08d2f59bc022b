#include "solver/reprojection.h"

#include <cmath>

namespace bslam::solver {

std::optional<ReprojectionResidual> ReprojectionResidual::evaluate(const Rig& rig, CameraIndex i,
                                                                   const SE3& T_rig_world, const Vector3d& point_world,
                                                                   const Vector2d& pixel) {
  const Vector3d point_rig = T_rig_world * point_world;
  const SE3& T_cam_rig = rig.cam_from_rig(i);
  const auto projection = rig.camera(i).project_with_jacobian(T_cam_rig * point_rig);
  if (!projection) return std::nullopt;
  const Matrix23d J_rig = -projection->jacobian * T_cam_rig.matrix3();  // de / dP'
  ReprojectionResidual out;
  out.error = pixel - projection->pixel;
  out.J_pose << -J_rig * geometry::skew(point_rig), J_rig;
  out.J_point = J_rig * T_rig_world.matrix3();
  return out;
}

std::optional<Vector2d> ReprojectionResidual::error_only(const Rig& rig, CameraIndex i, const SE3& T_rig_world,
                                                         const Vector3d& point_world, const Vector2d& pixel) {
  const auto projected = rig.camera(i).project(rig.cam_from_rig(i) * (T_rig_world * point_world));
  if (!projected) return std::nullopt;
  return Vector2d(pixel - *projected);
}

double huber_weight(double chi2, double knee_chi2) { return chi2 <= knee_chi2 ? 1.0 : std::sqrt(knee_chi2 / chi2); }

double huber_cost(double chi2, double knee_chi2) {
  return chi2 <= knee_chi2 ? chi2 : 2.0 * std::sqrt(knee_chi2 * chi2) - knee_chi2;
}

}  // namespace bslam::solver
