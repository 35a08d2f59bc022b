#include "calibration/unobserved_cameras.h"

namespace bslam::calibration {
namespace {

// R_given_estimated, see above: both models show the same direction at the centre of the image.
geometry::SE3 absorbed_rotation(const camera::Camera& given, const camera::CameraModel& estimated) {
  camera::Camera changed = given;
  changed.model = estimated;
  const Eigen::Vector2d centre(0.5 * (given.width - 1), 0.5 * (given.height - 1));
  const auto before = given.unproject(centre), after = changed.unproject(centre);
  if (!before || !after) return {};
  return {Eigen::Quaterniond::FromTwoVectors(*after, *before), Eigen::Vector3d::Zero()};
}

}  // namespace

void complete_unobserved_cameras(const camera::Rig& given, solver::RigAdjustment& adjusted) {
  constexpr int kMinObservations = 100;
  solver::RigValues& values = adjusted.values;
  const geometry::SE3 rotation = absorbed_rotation(given.camera(0), values.models[0]);
  for (std::size_t c = 1; c < values.T_cam_rig.size(); ++c) {
    if (adjusted.cameras[c].observations >= kMinObservations) continue;
    values.T_cam_rig[c] = given.cam_from_rig(c) * rotation;
    adjusted.cameras[c].change = solver::extrinsic_change(values.T_cam_rig[c], given.cam_from_rig(c));
  }
}

}  // namespace bslam::calibration
