#include "solver/reprojection.h"

namespace bslam::solver {

std::optional<ReprojectionResidual> ReprojectionResidual::evaluate(const Rig& rig, CameraIndex i,
                                                                   const SE3& T_rig_world, const Vector3d& point_world,
                                                                   const Vector2d& pixel) {
  const Vector3d point_rig = T_rig_world * point_world;
  const SE3& T_cam_rig = rig.cam_from_rig(i);
  const camera::Shutter& shutter = rig.shutter(i.index());
  const Vector3d point_cam = shutter.at_row(T_cam_rig * point_rig, pixel.y());
  const auto r = residual(rig.camera(i).model, point_cam, pixel);
  if (!r) return std::nullopt;
  const Matrix23d J_cam = shutter.rolling() ? (r->J * shutter.row_jacobian(pixel.y())).eval() : r->J;
  const Matrix23d J_rig = -J_cam * T_cam_rig.matrix3();  // de / dP'
  return ReprojectionResidual{r->error, pose_jacobian_transposed(J_rig, point_rig).transpose(),
                              J_rig * T_rig_world.matrix3()};
}

std::optional<Vector2d> ReprojectionResidual::error_only(const Rig& rig, CameraIndex i, const SE3& T_rig_world,
                                                         const Vector3d& point_world, const Vector2d& pixel) {
  const Vector3d point_cam = rig.cam_from_rig(i) * (T_rig_world * point_world);
  return residual_error(rig.camera(i).model, rig.shutter(i.index()), point_cam, pixel);
}

}  // namespace bslam::solver
