#include "calibration/rig_estimate.h"

#include <Eigen/Cholesky>
#include <algorithm>

#include "adjustment/landmark_noise.h"
#include "calibration/calibration_prior.h"
#include "calibration/image_equations.h"
#include "calibration/lost_observations.h"
#include "calibration/path_scale.h"

namespace bslam::calibration {
namespace {

// Maximum number of adjustments. Before each one but the first, rejected observations are searched for again.
constexpr int kPasses = 4;
// Relative decrease of the cost at which preliminary adjustments stop. The sum of squared errors of 10,000 observations
// then changes by about one; since correlated observations count less, the parameters are within a fraction of a
// standard deviation of the optimum, which does not change a decision.
constexpr double kCoarseDecrease = 1e-4;
constexpr int kQuickKeyframes = 40, kQuickLandmarks = 1000;  // enough for a verdict

// Returns true if no extrinsics have moved from `before` by more than their own uncertainty.
bool converged(const RigAdjustment& adjusted, const solver::RigValues& before) {
  for (std::size_t c = 1; c < before.T_cam_rig.size(); ++c) {
    const geometry::Vector6d change = solver::extrinsic_change(adjusted.values.T_cam_rig[c], before.T_cam_rig[c]);
    if (change.dot(adjusted.cameras[c].covariance.llt().solve(change)) > static_cast<double>(change.size()))
      return false;
  }
  return true;
}

// Adjusts again with the variance of each landmark (adjustment/landmark_noise.h), from the estimate `from`.
RigAdjustment adjust_weighted(RigAdjustmentOptions options, RigAdjustment from, RigProblem& problem,
                              const std::stop_token& stop) {
  solver::ReprojectionProblem& selected = problem.selected.problem;
  const auto chi2 = solver::squared_errors(selected, selected.T_rig_world, selected.points, from.values);
  adjustment::apply_variances(
      adjustment::landmark_variances(selected, chi2, solver::beyond(chi2, solver::kChi2TwoDof95)), selected);
  options.start_is_estimate = true;
  RigAdjustment out = adjust_rig(selected, options, from.values, stop);
  if (!out.done) return from;
  out.scale_change *= from.scale_change;
  return out;
}

// The values with which an estimate begins: those of the map.
solver::RigValues start_of(const map::BundledMap& map, const MovedCameras& cameras) {
  return cameras.added_to(solver::RigValues::of(map.rig().in_frame_of_camera_0()));
}

// Searches for rejected observations again, with the estimated extrinsics.
int recover(const EstimateInput& input, const MovedCameras& cameras, const solver::RigValues& values,
            RigProblem& problem) {
  const std::vector<geometry::SE3> motion = problem.selected.problem.motion;
  cameras.join(input.map, values, problem);
  const int recovered =
      recover_observations(input.map, cameras.of_rig(values).applied_to(input.map.rig()), input.features, problem);
  if (cameras.moves().empty()) return recovered;
  problem.selected.problem.motion.clear();
  cameras.separate(input.map, problem);
  problem.selected.problem.motion = motion;
  return recovered;
}

// Adjusts, and adjusts again if the errors within images are more correlated than the options say, which then say so.
// The first result, which trusts the images too much, is not used even if the second adjustment fails.
RigAdjustment adjust_correlated(const EstimateInput& input, RigAdjustmentOptions& options,
                                const solver::RigValues& start, RigProblem& problem) {
  const solver::ReprojectionProblem before = problem.selected.problem;
  RigAdjustment out = adjust_rig(problem.selected.problem, options, start, input.stop);
  if (!out.done) return out;
  const double correlated = correlation_in_images(input.map, problem, out.values);
  if (correlated <= options.correlated_observations) return out;
  options.correlated_observations = correlated;
  problem.selected.problem = before;
  return adjust_rig(problem.selected.problem, options, start, input.stop);
}

// A map built with a wrong calibration contains mostly the observations that agree with it, so adjusting it once stops
// short of the truth. Therefore the rejected observations are searched again with the new calibration.
void adjust_in_passes(const EstimateInput& input, RigAdjustmentOptions options, RigEstimate& estimate) {
  RigAdjustmentOptions coarse = options;
  coarse.relative_decrease = kCoarseDecrease;
  solver::RigValues before = start_of(input.map, estimate.cameras);
  separate_groups(estimate.problem);
  RigAdjustment out = adjust_correlated(input, coarse, before, estimate.problem);
  options.correlated_observations = coarse.correlated_observations;
  for (int pass = 1; out.done; ++pass) {
    estimate.settled = converged(out, before);
    if (estimate.settled || pass == kPasses) break;
    before = out.values;
    estimate.settled = recover(input, estimate.cameras, before, estimate.problem) == 0;
    if (estimate.settled) break;
    separate_groups(estimate.problem);
    RigAdjustment again = adjust_rig(estimate.problem.selected.problem, coarse, before, input.stop);
    if (!again.done) break;
    again.scale_change *= out.scale_change;
    out = std::move(again);
  }
  estimate.adjusted = out.done ? adjust_weighted(options, std::move(out), estimate.problem, input.stop) : out;
}

}  // namespace

CalibrationOptions quick(CalibrationOptions options) {
  options.keyframes = std::min(options.keyframes, kQuickKeyframes);
  options.landmarks = std::min(options.landmarks, kQuickLandmarks);
  return options;
}

RigAdjustmentOptions for_verdict(RigAdjustmentOptions options) {
  options.relative_decrease = kCoarseDecrease;
  options.pose_effects = false;
  return options;
}

RigAdjustmentOptions prior_with_timing(const EstimateInput& input, const MovedCameras& cameras) {
  RigAdjustmentOptions prior = prior_without_timing(input.calibrated, input.options);
  const camera::Rig reference = cameras.added_to(with_time_offsets_of(input.map.rig(), input.calibrated));
  RigProblem problem = choose(input.map, true, quick(input.options), input.features);
  problem.selected.problem.rig = &reference;
  cameras.separate(input.map, problem);
  separate_groups(problem);
  RigAdjustmentOptions with_timing = for_verdict(prior);
  with_timing.timing = timing_prior(input.map.rig(), input.calibrated, input.options);
  RigAdjustmentOptions of_cameras = cameras.added_to(with_timing);
  const RigAdjustment adjusted = adjust_correlated(input, of_cameras, start_of(input.map, cameras), problem);
  if (adjusted.done) prior.timing = contradicted(with_timing.timing, input.map.rig(), adjusted, input.options);
  return prior;
}

RigEstimate estimate_rig(const EstimateInput& input, const RigAdjustmentOptions& prior, MovedCameras cameras) {
  RigEstimate out{std::move(cameras), {}, choose(input.map, !prior.timing.empty(), input.options, input.features)};
  out.reference = std::make_shared<const camera::Rig>(
      out.cameras.added_to(with_time_offsets_of(input.map.rig(), input.calibrated)));
  out.problem.selected.problem.rig = out.reference.get();
  out.cameras.separate(input.map, out.problem);
  out.path_before = path_length(out.problem);
  adjust_in_passes(input, out.cameras.added_to(prior), out);
  if (!out.adjusted.done || !out.settled) return out;
  if (const auto camera = unsteady_camera(input.map, out.problem, out.adjusted.values))
    out.unsteady = out.cameras.camera_of_rig(*camera);
  return out;
}

}  // namespace bslam::calibration
