#include "calibration/time_jump.h"

#include <Eigen/Cholesky>
#include <cmath>

#include "calibration/image_equations.h"

namespace bslam::calibration {

std::optional<TimeJump> likely_jump(const map::BundledMap& map, const RigProblem& problem,
                                    const solver::RigValues& values, std::size_t camera, TimeNs from) {
  const std::size_t cameras = values.T_cam_rig.size();
  const std::vector<std::size_t> poses = poses_by_time(map, problem);
  const std::vector<ImageEquations> equations = image_equations(problem, values);
  const geometry::Matrix6d of_rig = (values.T_cam_rig[camera] * map.rig().cam_from_rig(0)).adjoint();
  ImageEquations all;
  for (const std::size_t pose : poses) all.add(equations[pose * cameras + camera]);
  const Eigen::LDLT<geometry::Matrix6d> factor(all.H);
  const geometry::Vector6d shared = factor.solve(all.b);
  // The normal equation of the shift, and its coupling with the change that all keyframes share.
  double h = 0, g = 0;
  geometry::Vector6d coupling = geometry::Vector6d::Zero();
  int keyframes = 0;
  std::optional<TimeJump> best;
  for (std::size_t i = poses.size(); i-- > 1;) {
    const std::size_t pose = poses[i];
    const map::BundledKeyframe& keyframe = map.keyframe(problem.selected.keyframes[pose]);
    if (keyframe.frame->time_ns < from) break;
    const ImageEquations& image = equations[pose * cameras + camera];
    const geometry::Vector6d per_second = of_rig * keyframe.twist, of_image = image.H * per_second;
    h += per_second.dot(of_image);
    g += per_second.dot(image.b);
    coupling += of_image;
    keyframes += image.keyframes;
    if (std::min(keyframes, all.keyframes - keyframes) < kMinKeyframes) continue;
    const double information = h - coupling.dot(factor.solve(coupling)), gradient = g - coupling.dot(shared);
    const double shift_s = gradient / information, chi2 = gradient * shift_s;
    if (std::isfinite(chi2) && (!best || chi2 > best->chi2)) best = {camera, keyframe.frame->time_ns, shift_s, chi2};
  }
  return best;
}

}  // namespace bslam::calibration
