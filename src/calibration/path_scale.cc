#include "calibration/path_scale.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/assert.h"
#include "calibration/calibration_prior.h"
#include "calibration/rig_frame.h"

namespace bslam::calibration {
namespace {

// maximum change of scale that is withheld because it is within the standard deviation
constexpr double kMaxDeviation = 0.05;

// Calls visit(i, step) with the displacement from keyframe i - 1 to keyframe i of the same group.
template <class Visit>
void for_each_step(const RigProblem& problem, const Visit& visit) {
  const std::vector<geometry::SE3>& poses = problem.selected.problem.T_rig_world;
  for (std::size_t i = 1; i < poses.size(); ++i) {
    if (problem.group[i] == problem.group[i - 1])
      visit(i, Eigen::Vector3d(poses[i].inverse().translation() - poses[i - 1].inverse().translation()));
  }
}

}  // namespace

double path_length(const RigProblem& problem) {
  double sum = 0;
  for_each_step(problem, [&](std::size_t, const Eigen::Vector3d& step) { sum += step.norm(); });
  return sum;
}

double path_deviation(const RigProblem& problem, const std::vector<geometry::PoseUncertainty::Effect>& effects) {
  const std::vector<geometry::SE3>& poses = problem.selected.problem.T_rig_world;
  BSLAM_ASSERT(effects.size() == poses.size(), "every pose must have an effect");
  if (effects.empty()) return 0;
  Eigen::RowVectorXd sum = Eigen::RowVectorXd::Zero(effects.front().cols());
  // The perturbation delta moves the centre of a pose by -R^T delta_t.
  const auto add = [&](std::size_t i, const Eigen::Vector3d& direction) {
    sum.noalias() -= (poses[i].rotation() * direction).transpose() * effects[i].bottomRows<3>();
  };
  for_each_step(problem, [&](std::size_t i, const Eigen::Vector3d& step) {
    const Eigen::Vector3d direction = step.stableNormalized();
    add(i, direction);
    add(i - 1, -direction);
  });
  return sum.norm();
}

void keep_scale(const CalibrationOptions& options, RigRefinement& refinement) {
  const double factor = 1 / refinement.scale_change;
  const double tolerance =
      std::max(0.01 * options.scale_tolerance_percent, std::min(refinement.scale_deviation, kMaxDeviation));
  const bool arbitrary = longest_baseline(*refinement.rig) == 0;
  if (!arbitrary && !(std::abs(std::log(factor)) < tolerance)) return;
  solver::RigValues values = solver::RigValues::of(refinement.rig->in_frame_of_camera_0());
  for (geometry::SE3& T : values.T_cam_rig) T = geometry::scaled(T, factor);
  std::vector<camera::CameraMove> moves(refinement.rig->moves().begin(), refinement.rig->moves().end());
  for (camera::CameraMove& move : moves) move.T_after_initial = geometry::scaled(move.T_after_initial, factor);
  refinement.rig = with_rig_frame(values.applied_to(*refinement.rig), refinement.rig->cam_from_rig(0),
                                  refinement.rig->body_from_rig())
                       .with_moves(std::move(moves));
  for (auto& [keyframe, T_rig_world] : refinement.poses.keyframes) T_rig_world = geometry::scaled(T_rig_world, factor);
  for (auto& [landmark, position] : refinement.poses.landmarks) position *= factor;
  refinement.scale_change = 1;
  refinement.kept_scale *= factor;
}

}  // namespace bslam::calibration
