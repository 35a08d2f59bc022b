#include "calibration/unobserved_cameras.h"

#include "calibration/rig_frame.h"

namespace bslam::calibration {
void complete_unobserved_cameras(const camera::Rig& given, RigAdjustment& adjusted) {
  constexpr int kMinObservations = 100;
  solver::RigValues& values = adjusted.values;
  camera::Camera estimated = given.camera(0);
  estimated.model = values.models[0];
  const geometry::SE3 T_given_estimated = turn_of_rays(estimated, given.camera(0)).inverse();
  for (std::size_t c = 1; c < given.size(); ++c) {
    if (adjusted.cameras[c].observations >= kMinObservations) continue;
    values.T_cam_rig[c] = given.cam_from_rig(c) * T_given_estimated;
    adjusted.cameras[c].change = solver::extrinsic_change(values.T_cam_rig[c], given.cam_from_rig(c));
  }
}

}  // namespace bslam::calibration
