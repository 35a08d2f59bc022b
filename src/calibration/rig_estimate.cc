#include "calibration/rig_estimate.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "adjustment/landmark_noise.h"
#include "calibration/calibration_prior.h"
#include "calibration/lost_observations.h"
#include "calibration/path_scale.h"

namespace bslam::calibration {
namespace {

constexpr double kMillimetresPerMetre = 1000.0;
// Maximum number of adjustments. Before each one but the first, rejected observations are searched for again.
constexpr int kPasses = 4;
// Relative decrease of the cost at which preliminary adjustments stop. The sum of squared errors of 10,000 observations
// then changes by about one; since correlated observations count less, the parameters are within a fraction of a
// standard deviation of the optimum, which does not change a decision.
constexpr double kCoarseDecrease = 1e-4;
constexpr int kQuickKeyframes = 40, kQuickLandmarks = 1000;  // enough for a verdict

constexpr int kMaxTries = 5;        // further moves that are tried; if others remain, moves are not the reason
constexpr int kMaxCorrections = 3;  // of the times of moves
// A move is accepted if the camera turned or was displaced by so many standard deviations and more than these bounds.
// On recordings without moves, the estimates were below 0.035 degrees and 4.5 mm.
constexpr double kMinMoveSigmas = 6, kMinTurn_deg = 0.04, kMinShift_mm = 5;
// A move is tried if, with everything else constant, it decreases the cost by so much, and its estimate is at least a
// sixth of a bound: the constant poses and points hide the rest.
constexpr double kMinMoveChi2 = 50, kHidden = 6;

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
  solver::ReprojectionProblem& flat = problem.flat.problem;
  const auto chi2 = solver::squared_errors(flat, flat.T_rig_world, flat.points, from.values);
  adjustment::apply_variances(adjustment::landmark_variances(flat, chi2, solver::beyond(chi2, solver::kChi2TwoDof95)),
                              flat);
  options.start_is_estimate = true;
  RigAdjustment out = adjust_rig(flat, options, from.values, stop);
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
  const std::vector<geometry::SE3> motion = problem.flat.problem.motion;
  cameras.join(input.map, values, problem);
  const int recovered =
      recover_observations(input.map, cameras.of_rig(values).applied_to(input.map.rig()), input.features, problem.flat);
  if (cameras.moves().empty()) return recovered;
  problem.flat.problem.motion.clear();
  cameras.separate(input.map, problem);
  problem.flat.problem.motion = motion;
  return recovered;
}

// A map built with a wrong calibration contains mostly the observations that agree with it, so adjusting it once stops
// short of the truth. Therefore the rejected observations are searched again with the new calibration.
RigAdjustment adjust_in_passes(const EstimateInput& input, const RigAdjustmentOptions& options,
                               const MovedCameras& cameras, RigProblem& problem) {
  RigAdjustmentOptions coarse = options;
  coarse.relative_decrease = kCoarseDecrease;
  solver::RigValues before = start_of(input.map, cameras);
  separate_groups(problem);
  RigAdjustment out = adjust_rig(problem.flat.problem, coarse, before, input.stop);
  for (int pass = 1; pass < kPasses && out.done && !converged(out, before); ++pass) {
    before = out.values;
    if (recover(input, cameras, before, problem) == 0) break;
    separate_groups(problem);
    RigAdjustment again = adjust_rig(problem.flat.problem, coarse, before, input.stop);
    if (!again.done) break;
    again.scale_change *= out.scale_change;
    out = std::move(again);
  }
  return out.done ? adjust_weighted(options, std::move(out), problem, input.stop) : out;
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
  problem.flat.problem.rig = &reference;
  cameras.separate(input.map, problem);
  separate_groups(problem);
  RigAdjustmentOptions with_timing = for_verdict(prior);
  with_timing.timing = timing_prior(input.map.rig(), input.calibrated, input.options);
  const auto adjusted =
      adjust_rig(problem.flat.problem, cameras.added_to(with_timing), start_of(input.map, cameras), input.stop);
  if (adjusted.done) prior.timing = contradicted(with_timing.timing, input.map.rig(), adjusted, input.options);
  return prior;
}

RigEstimate estimate_rig(const EstimateInput& input, const RigAdjustmentOptions& prior, MovedCameras cameras) {
  RigEstimate out{std::move(cameras), {}, choose(input.map, !prior.timing.empty(), input.options, input.features), {}};
  out.reference = std::make_shared<const camera::Rig>(
      out.cameras.added_to(with_time_offsets_of(input.map.rig(), input.calibrated)));
  out.problem.flat.problem.rig = out.reference.get();
  out.cameras.separate(input.map, out.problem);
  out.path_before = path_length(out.problem);
  out.adjusted = adjust_in_passes(input, out.cameras.added_to(prior), out.cameras, out.problem);
  return out;
}

namespace {

// Square root of the largest eigenvalue.
double largest_deviation(const Eigen::Matrix3d& covariance) {
  return std::sqrt(
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(covariance, Eigen::EigenvaluesOnly).eigenvalues().maxCoeff());
}

double mahalanobis_distance(const Eigen::Vector3d& change, const Eigen::Matrix3d& covariance) {
  return std::sqrt(change.dot(covariance.llt().solve(change)));
}

// Move m of an estimate. `covariance`: of RigInformation::change.
MoveEstimate move_of(const RigEstimate& estimate, const Eigen::MatrixXd& covariance, std::size_t m) {
  const std::vector<camera::CameraMove>& moves = estimate.cameras.moves();
  const std::vector<geometry::SE3>& T_cam_rig = estimate.adjusted.values.T_cam_rig;
  const std::size_t before = estimate.cameras.before(m), after = T_cam_rig.size() - moves.size() + m;
  const auto at = [](std::size_t camera) { return 6 * (static_cast<Eigen::Index>(camera) - 1); };
  geometry::Matrix6d of_change = covariance.block<6, 6>(at(after), at(after));
  if (before > 0) {
    of_change += covariance.block<6, 6>(at(before), at(before));
    of_change -= covariance.block<6, 6>(at(before), at(after)) + covariance.block<6, 6>(at(after), at(before));
  }
  const geometry::Vector6d change = solver::extrinsic_change(T_cam_rig[after], T_cam_rig[before]);
  const Eigen::Matrix3d turn = of_change.topLeftCorner<3, 3>(), shift = of_change.bottomRightCorner<3, 3>();
  return {.camera = moves[m].camera,
          .time_ns = moves[m].time_ns,
          .change_deg = geometry::degrees(change.head<3>().norm()),
          .std_deg = geometry::degrees(largest_deviation(turn)),
          .change_mm = kMillimetresPerMetre * change.tail<3>().norm(),
          .std_mm = kMillimetresPerMetre * largest_deviation(shift),
          .rotation_sigmas = mahalanobis_distance(change.head<3>(), turn),
          .translation_sigmas = mahalanobis_distance(change.tail<3>(), shift)};
}

bool significant(const MoveEstimate& move) {
  return (move.rotation_sigmas > kMinMoveSigmas && move.change_deg > kMinTurn_deg) ||
         (move.translation_sigmas > kMinMoveSigmas && move.change_mm > kMinShift_mm);
}

// The moves with the most likely further one; nullopt if there is hardly any evidence for one. The recordings of a map
// may have unrelated times; the moves of one do not concern the others.
std::optional<MovedCameras> with_likely_move(const EstimateInput& input, const RigEstimate& estimate) {
  const std::vector<KeyframeId>& keyframes = estimate.problem.flat.keyframes;
  const auto time_of = [&](KeyframeId k) { return input.map.keyframe(k).frame->time_ns; };
  if (!std::ranges::is_sorted(keyframes, {}, time_of)) return std::nullopt;
  const auto found = estimate.cameras.most_likely_move(estimate.problem, estimate.adjusted.values);
  if (!found || found->chi2 < kMinMoveChi2) return std::nullopt;
  const double turn_deg = geometry::degrees(found->change.head<3>().norm()),
               shift_mm = kMillimetresPerMetre * found->change.tail<3>().norm();
  if (kHidden * turn_deg < kMinTurn_deg && kHidden * shift_mm < kMinShift_mm) return std::nullopt;
  const auto known = estimate.cameras.moves_of(estimate.adjusted.values);
  return estimate.cameras.with_move(known, *found, time_of(keyframes[found->pose]));
}

}  // namespace

std::vector<MoveEstimate> moves_of(const RigEstimate& estimate) {
  std::vector<MoveEstimate> out;
  const Eigen::LLT<Eigen::MatrixXd> factor(estimate.adjusted.information.information);
  if (!estimate.adjusted.done || factor.info() != Eigen::Success) return out;
  const Eigen::MatrixXd covariance = factor.solve(Eigen::MatrixXd::Identity(factor.rows(), factor.cols()));
  for (std::size_t m = 0; m < estimate.cameras.moves().size(); ++m) out.push_back(move_of(estimate, covariance, m));
  return out;
}

namespace {

bool same_times(const std::vector<camera::CameraMove>& a, const std::vector<camera::CameraMove>& b) {
  return std::ranges::equal(a, b, {}, &camera::CameraMove::time_ns, &camera::CameraMove::time_ns);
}

// Estimates the calibration with these moves at the times that fit best.
RigEstimate estimate_at_best_times(const EstimateInput& input, const RigAdjustmentOptions& prior,
                                   MovedCameras cameras) {
  RigEstimate out = estimate_rig(input, prior, std::move(cameras));
  for (int i = 0; i < kMaxCorrections && out.adjusted.done; ++i) {
    auto moves = out.cameras.at_best_times(input.map, out.problem, out.adjusted.values);
    if (same_times(moves, out.cameras.moves())) break;
    out = estimate_rig(input, prior, {input.map.rig().size(), std::move(moves)});
  }
  return out;
}

// Estimates the calibration with those of these moves that are significant.
RigEstimate estimate_significant_moves(const EstimateInput& input, const RigAdjustmentOptions& prior,
                                       MovedCameras cameras) {
  RigEstimate out = estimate_at_best_times(input, prior, std::move(cameras));
  const std::vector<MoveEstimate> moves = moves_of(out);
  std::vector<camera::CameraMove> kept;
  for (std::size_t m = 0; m < moves.size(); ++m) {
    if (significant(moves[m])) kept.push_back(out.cameras.moves()[m]);
  }
  if (!out.adjusted.done || kept.size() == moves.size()) return out;
  MovedCameras fewer(input.map.rig().size(), std::move(kept));
  return estimate_at_best_times(input, prior_with_timing(input, fewer), std::move(fewer));
}

}  // namespace

RigEstimate estimate_rig_and_moves(const EstimateInput& input, const RigAdjustmentOptions& prior,
                                   MovedCameras cameras) {
  RigEstimate known = cameras.moves().empty() ? estimate_rig(input, prior, std::move(cameras))
                                              : estimate_significant_moves(input, prior, std::move(cameras));
  // The first moves that are tried may be at wrong times and be replaced by others.
  std::optional<RigEstimate> latest;
  for (int i = 0; i < kMaxTries; ++i) {
    const RigEstimate& before = latest ? *latest : known;
    auto more = before.adjusted.done ? with_likely_move(input, before) : std::nullopt;
    if (!more) return latest ? *std::move(latest) : std::move(known);
    // Its effect may have looked like wrong times, which are tested again.
    const RigAdjustmentOptions prior_with_move = prior_with_timing(input, *more);
    RigEstimate next = estimate_significant_moves(input, prior_with_move, std::move(*more));
    if (!next.adjusted.done || same_times(next.cameras.moves(), before.cameras.moves()))
      return latest ? *std::move(latest) : std::move(known);
    latest = std::move(next);
  }
  return known;  // something else than moves
}

}  // namespace bslam::calibration
