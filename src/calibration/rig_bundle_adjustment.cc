#include "calibration/rig_bundle_adjustment.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/assert.h"
#include "calibration/deviation.h"
#include "solver/bundle_equations.h"

namespace bslam::calibration {
namespace {

constexpr int kDensePoses = 150;

// Convergence of all rounds but the last: they only determine which observations the next one uses.
constexpr double kEarlyDecrease = 1e-4;

struct Round {
  solver::Kernel kernel;
  double max_chi2;  // maximum squared normalised error of observations that are used
};
constexpr std::array kRounds = {
    Round{solver::Kernel::kHuber, solver::kMaxChi2}, Round{solver::Kernel::kHuber, 16 * solver::kChi2TwoDof95},
    Round{solver::Kernel::kNone, solver::kChi2TwoDof95}, Round{solver::Kernel::kNone, solver::kChi2TwoDof95}};

// The blocks of an adjustment: the extrinsics, then the intrinsics and the timing unless they are constant.
struct CalibrationBlocks {
  solver::RigBlocks blocks;
  const solver::ExtrinsicsBlock* extrinsics = nullptr;
  const solver::IntrinsicsBlock* intrinsics = nullptr;  // null if they are constant
  const solver::TimingBlock* timing = nullptr;          // null if it is constant
  std::vector<std::uint8_t> displaced;                  // flags of ExtrinsicPrior
  int size = 0;                                         // number of unknowns

  int first_intrinsics() const { return extrinsics->size(); }
  void add(std::unique_ptr<solver::RigBlock> block) {
    size += block->size();
    blocks.push_back(std::move(block));
  }
};

std::unique_ptr<solver::IntrinsicsBlock> make_intrinsics(const solver::RigValues& calibrated,
                                                         const RigAdjustmentOptions& options, double tighter) {
  solver::IntrinsicPrior prior{{}, options.sigma_intrinsics, tighter * options.sigma_aspect, options.shared};
  for (camera::ModelParameters& sigma : prior.sigmas) sigma *= tighter;
  for (const camera::CameraModel& model : calibrated.models) prior.values.push_back(camera::parameters(model));
  return std::make_unique<solver::IntrinsicsBlock>(std::move(prior));
}

std::unique_ptr<solver::TimingBlock> make_timing(const RigAdjustmentOptions& options, double tighter) {
  std::vector<solver::TimingPrior> prior = options.timing;
  for (solver::TimingPrior& p : prior) {
    p.sigma_shift *= tighter;
    p.sigma_readout *= tighter;
  }
  return std::make_unique<solver::TimingBlock>(std::move(prior), options.shared);
}

// The number of cameras that are not another one after a move, which are the first ones.
std::size_t num_cameras_of_rig(const solver::RigValues& calibrated, const RigAdjustmentOptions& options) {
  std::size_t n = 0;
  while (n < calibrated.models.size() && solver::has_own_unknowns(options.shared, n)) ++n;
  return n;
}

solver::ExtrinsicPrior extrinsic_prior(const solver::RigValues& calibrated, const RigAdjustmentOptions& options,
                                       double tighter, std::vector<std::uint8_t> displaced = {}) {
  return {.T_cam_rig = calibrated.T_cam_rig,
          .sigma_rotation = tighter * options.sigma_rotation,
          .sigma_translation = tighter * options.sigma_translation,
          .sigma_depth = tighter * options.sigma_depth,
          .sigma_scale = tighter * options.sigma_scale,
          .with_baseline = num_cameras_of_rig(calibrated, options),
          .displaced = std::move(displaced)};
}

CalibrationBlocks make_blocks(const solver::RigValues& calibrated, const RigAdjustmentOptions& options,
                              const std::vector<std::uint8_t>& displaced) {
  CalibrationBlocks out;
  out.displaced = displaced;
  const double tighter = 1.0 / std::sqrt(options.correlated_observations);
  auto extrinsics = std::make_unique<solver::ExtrinsicsBlock>(extrinsic_prior(calibrated, options, tighter, displaced));
  out.extrinsics = extrinsics.get();
  out.add(std::move(extrinsics));
  if (!options.sigma_intrinsics.empty()) {
    auto intrinsics = make_intrinsics(calibrated, options, tighter);
    out.intrinsics = intrinsics.get();
    out.add(std::move(intrinsics));
  }
  if (!options.timing.empty()) {
    auto timing = make_timing(options, tighter);
    out.timing = timing.get();
    out.add(std::move(timing));
  }
  return out;
}

// Number of residuals minus number of unknowns, at least 1.
double redundancy(const solver::BundleStructure& structure, int rig_unknowns) {
  const double residuals = 2.0 * static_cast<double>(structure.terms.size());
  const double unknowns = 3.0 * static_cast<double>(structure.num_points()) +
                          6.0 * static_cast<double>(structure.pose_of_slot.size()) + rig_unknowns;
  return std::max(1.0, residuals - unknowns);
}

// Mean squared error over its expectation for the truncated distribution, corrected for the number of unknowns.
double variance_factor(double redundancy, double cost) {
  return 2.0 * cost / (redundancy * solver::kVarianceLeft / solver::kFractionLeft);
}

// Relative increase of the mean squared error if the calibration were constant, less the increase that is to be
// expected if it is right, because its estimate fits the errors of the images. `information`: with the prior.
double excess_error(const Eigen::VectorXd& change, const Eigen::MatrixXd& information, const Eigen::MatrixXd& of_images,
                    double correlated_observations, double redundancy, double cost) {
  const Eigen::MatrixXd shrinkage = information.ldlt().solve(of_images);
  const double by_noise = correlated_observations * (shrinkage * shrinkage).trace() / redundancy;
  return std::max(0.0, change.dot(of_images * change) / std::max(1.0, 2.0 * cost) - by_noise);
}

void report_extrinsics(const Eigen::MatrixXd& covariance, const solver::ExtrinsicPrior& prior, RigAdjustment& out) {
  for (std::size_t c = 1; c < out.cameras.size(); ++c) {
    CameraEstimate& camera = out.cameras[c];
    const auto at = static_cast<Eigen::Index>(6 * (c - 1));
    camera.covariance = covariance.block<6, 6>(at, at);
    const geometry::Matrix6d of_prior = solver::covariance_of(prior, c);
    for (int k = 0; k < 6; ++k)
      camera.observed[static_cast<std::size_t>(k)] =
          std::sqrt(camera.covariance(k, k)) < kObservedRatio * std::sqrt(of_prior(k, k));
    camera.unobserved_shift = unobserved_length(camera.change.tail<3>(), camera.covariance.bottomRightCorner<3, 3>(),
                                                of_prior.bottomRightCorner<3, 3>(), kObservedRatio);
  }
}

// `sigma`: standard deviations of the unknowns of IntrinsicsBlock, which are relative to those of the prior.
void report_intrinsics(const Eigen::VectorXd& sigma, const solver::RigValues& calibrated,
                       const RigAdjustmentOptions& options, RigAdjustment& out) {
  Eigen::Index at = 0;
  for (std::size_t c = 0; c < out.cameras.size(); ++c) {
    if (!solver::has_own_unknowns(options.shared, c)) continue;
    CameraEstimate& camera = out.cameras[c];
    camera.intrinsics_change = camera::parameters(out.values.models[c]) - camera::parameters(calibrated.models[c]);
    const camera::ModelParameters relative =
        sigma.segment(at, camera.intrinsics_change.size()) / std::sqrt(options.correlated_observations);
    camera.intrinsics_sigma = relative.cwiseProduct(options.sigma_intrinsics[c]);
    for (const double s : relative) camera.intrinsics_observed.push_back(s < kObservedRatio);
    at += relative.size();
  }
}

// `sigma`: standard deviations of the unknowns of TimingBlock, which are relative to those of the prior.
void report_timing(const Eigen::VectorXd& sigma, const RigAdjustmentOptions& options, RigAdjustment& out) {
  const double wider = 1.0 / std::sqrt(options.correlated_observations);
  Eigen::Index at = 0;
  for (std::size_t c = 0; c < out.cameras.size(); ++c) {
    if (!solver::has_own_unknowns(options.shared, c)) continue;
    CameraEstimate& camera = out.cameras[c];
    const solver::TimingPrior& prior = options.timing[c];
    camera.timing_change = {out.values.timing[c].shift_s - prior.mean.shift_s,
                            out.values.timing[c].readout_s - prior.mean.readout_s};
    if (prior.sigma_shift > 0) camera.timing_sigma.shift_s = wider * sigma(at++) * prior.sigma_shift;
    if (prior.sigma_readout > 0) camera.timing_sigma.readout_s = wider * sigma(at++) * prior.sigma_readout;
  }
}

// Change of all unknowns from the calibration, in the order of the blocks.
Eigen::VectorXd change_of(const RigAdjustment& out, const CalibrationBlocks& blocks) {
  Eigen::VectorXd change(blocks.size);
  for (std::size_t c = 1; c < out.cameras.size(); ++c)
    change.segment<6>(static_cast<Eigen::Index>(6 * (c - 1))) = out.cameras[c].change;
  if (blocks.intrinsics != nullptr)
    change.segment(blocks.first_intrinsics(), blocks.intrinsics->size()) =
        blocks.intrinsics->normalised_change(out.values);
  if (blocks.timing != nullptr) change.tail(blocks.timing->size()) = blocks.timing->normalised_change(out.values);
  return change;
}

// The information about extrinsics and intrinsics alone, with the timing marginalised out.
Eigen::MatrixXd without_timing(const Eigen::MatrixXd& information, const CalibrationBlocks& blocks) {
  if (blocks.timing == nullptr || blocks.timing->size() == 0) return information;
  const Eigen::Index timing = blocks.timing->size(), kept = information.rows() - timing;
  const Eigen::MatrixXd coupling = information.topRightCorner(kept, timing);
  return information.topLeftCorner(kept, kept) -
         coupling * information.bottomRightCorner(timing, timing).ldlt().solve(coupling.transpose());
}

// Factors that convert a derivative with respect to the unknowns of the blocks, in which intrinsics are relative to
// their deviations, to radians, metres and the units of the camera models.
Eigen::VectorXd physical_units(const RigAdjustmentOptions& options, Eigen::Index unknowns) {
  Eigen::VectorXd unit = Eigen::VectorXd::Ones(unknowns);
  Eigen::Index at = unknowns;
  std::vector<camera::ModelParameters> sigmas;  // of the cameras with own intrinsics
  for (std::size_t c = 0; c < options.sigma_intrinsics.size(); ++c) {
    if (solver::has_own_unknowns(options.shared, c)) sigmas.push_back(options.sigma_intrinsics[c]);
  }
  for (const camera::ModelParameters& sigma : sigmas) at -= sigma.size();
  for (const camera::ModelParameters& sigma : sigmas) {
    unit.segment(at, sigma.size()) = sigma.cwiseInverse() * std::sqrt(options.correlated_observations);
    at += sigma.size();
  }
  return unit;
}

// `information` and `prior` in the unknowns of the blocks, without timing.
RigInformation in_physical_units(const Eigen::MatrixXd& information, const Eigen::MatrixXd& prior,
                                 const RigAdjustmentOptions& options, const RigAdjustment& out) {
  const Eigen::VectorXd unit = physical_units(options, information.rows());
  RigInformation physical;
  physical.change.resize(information.rows());
  Eigen::Index at = 0;
  for (std::size_t c = 1; c < out.cameras.size(); ++c, at += 6) physical.change.segment<6>(at) = out.cameras[c].change;
  for (std::size_t c = 0; c < out.cameras.size() && at < information.rows(); ++c) {
    const camera::ModelParameters& change = out.cameras[c].intrinsics_change;
    physical.change.segment(at, change.size()) = change;
    at += change.size();
  }
  const double weight = 1 / options.correlated_observations;
  physical.information = weight * unit.asDiagonal() * information * unit.asDiagonal();
  physical.prior = weight * unit.asDiagonal() * prior * unit.asDiagonal();
  return physical;
}

// The perturbation of each pose by the error of the unknowns of the rig, `deviation` z.
std::vector<geometry::PoseUncertainty::Effect> effects_on_poses(const Eigen::MatrixXd& deviation,
                                                                const solver::BundleEquations& equations) {
  std::vector<int> poses(equations.state().T_rig_world.size());
  std::iota(poses.begin(), poses.end(), 0);
  std::vector<geometry::PoseUncertainty::Effect> out;
  for (auto& effect : equations.rig_effects(poses, deviation))
    out.push_back(std::move(effect).value_or(geometry::PoseUncertainty::Effect::Zero(6, deviation.cols())));
  return out;
}

// Computes covariances and observed degrees of freedom at the current values. Returns false if the information is
// singular.
bool assess(solver::BundleEquations& equations, const CalibrationBlocks& blocks, const solver::RigValues& calibrated,
            const RigAdjustmentOptions& options, double redundancy, RigAdjustment& out) {
  equations.linearise();
  const auto information = equations.rig_information();
  if (!information) return false;
  const Eigen::MatrixXd prior = solver::information_of_prior(blocks.blocks, out.values);
  const Eigen::MatrixXd of_images = *information - prior;
  const double scale = solver::kVarianceLeft / solver::kFractionLeft / std::max(1.0, out.variance_factor);
  const Eigen::LLT<Eigen::MatrixXd> factor(scale * of_images + prior);
  if (factor.info() != Eigen::Success) return false;
  const Eigen::MatrixXd identity = Eigen::MatrixXd::Identity(blocks.size, blocks.size);
  const Eigen::MatrixXd covariance = options.correlated_observations * factor.solve(identity);
  if (options.pose_effects)
    out.pose_effects =
        effects_on_poses(std::sqrt(options.correlated_observations) * factor.matrixU().solve(identity), equations);
  report_extrinsics(covariance, extrinsic_prior(calibrated, options, 1.0, blocks.displaced), out);
  if (blocks.intrinsics != nullptr)
    report_intrinsics(covariance.diagonal().segment(blocks.first_intrinsics(), blocks.intrinsics->size()).cwiseSqrt(),
                      calibrated, options, out);
  if (blocks.timing != nullptr)
    report_timing(covariance.diagonal().tail(blocks.timing->size()).cwiseSqrt(), options, out);
  out.information =
      in_physical_units(without_timing(scale * of_images + prior, blocks), without_timing(prior, blocks), options, out);
  out.excess_error = excess_error(change_of(out, blocks), *information, of_images, options.correlated_observations,
                                  redundancy, out.final_cost);
  return true;
}

// Multiplies all lengths by a factor that gives the baselines the scale of the calibration; returns it.
double restore_scale(const solver::ExtrinsicPrior& prior, solver::ReprojectionProblem& problem,
                     solver::BundleState& state) {
  const double factor = 1.0 / solver::baseline_scale(state.rig.T_cam_rig, solver::baseline_weights(prior));
  for (geometry::SE3& T : state.rig.T_cam_rig) T = geometry::scaled(T, factor);
  for (geometry::SE3& T : state.T_rig_world) T = geometry::scaled(T, factor);
  for (geometry::Vector3d& point : state.points) point *= factor;
  for (geometry::SE3& T : problem.motion) T = geometry::scaled(T, factor);
  for (geometry::Vector6d& twist : problem.twist) twist = geometry::scaled(twist, factor);
  return factor;
}

// Returns true if the previous round had the same kernel and used the same observations, so that this round can be
// skipped.
bool repeats(const Round& round, const std::vector<std::uint8_t>& skip,
             const std::vector<std::uint8_t>& skipped_before) {
  return &round != &kRounds.front() && &round != &kRounds.back() && round.kernel == (&round - 1)->kernel &&
         skip == skipped_before;
}

// Runs one round from `state` and leaves its result there. Returns false if it failed or was stopped. `skipped`: flags
// of the observations that the previous round did not use, and then those of this round.
bool run_round(const solver::ReprojectionProblem& problem, const Round& round, const CalibrationBlocks& blocks,
               const solver::RigValues& calibrated, const RigAdjustmentOptions& options, const std::stop_token& stop,
               std::vector<std::uint8_t>& skipped, solver::BundleState& state, RigAdjustment& out) {
  const auto chi2 = solver::squared_errors(problem, state.T_rig_world, state.points, state.rig);
  std::vector<std::uint8_t> skip = solver::beyond(chi2, round.max_chi2);
  if (repeats(round, skip, skipped)) return true;
  skipped = std::move(skip);
  const solver::BundleStructure structure = solver::make_structure(problem, chi2, skipped);
  if (structure.num_points() == 0) return false;
  solver::BundleEquations equations(problem, structure, blocks.blocks, round.kernel, kDensePoses, std::move(state));
  const bool last = &round == &kRounds.back();
  const double decrease = last ? options.relative_decrease : std::max(kEarlyDecrease, options.relative_decrease);
  const solver::LmSummary summary =
      solver::minimise(equations, {.iterations = options.iterations, .relative_decrease = decrease}, stop);
  if (!summary.usable() || stop.stop_requested()) return false;
  if (last) {
    out.final_cost = summary.final_cost;
    const double redundant = redundancy(structure, blocks.size);
    out.variance_factor = variance_factor(redundant, summary.final_cost);
    out.values = equations.state().rig;
    for (std::size_t c = 0; c < out.cameras.size(); ++c)
      out.cameras[c].change = solver::extrinsic_change(out.values.T_cam_rig[c], calibrated.T_cam_rig[c]);
    for (const auto& term : structure.terms) ++out.cameras[static_cast<std::size_t>(term.camera)].observations;
    out.done = assess(equations, blocks, calibrated, options, redundant, out);
  }
  state = std::move(equations.state());
  return true;
}

}  // namespace

Eigen::MatrixXd prior_information(const solver::RigValues& calibrated, const RigAdjustmentOptions& options) {
  const CalibrationBlocks blocks = make_blocks(calibrated, options, {});
  const Eigen::VectorXd unit = physical_units(options, blocks.size);
  return unit.asDiagonal() * solver::information_of_prior(blocks.blocks, calibrated) * unit.asDiagonal() /
         options.correlated_observations;
}

RigAdjustment adjust_rig(solver::ReprojectionProblem& problem, const RigAdjustmentOptions& options,
                         std::optional<solver::RigValues> start, std::stop_token stop) {
  BSLAM_ASSERT(problem.rig != nullptr, "the problem must have a rig");
  BSLAM_ASSERT(options.sigma_rotation > 0 && options.sigma_translation > 0, "standard deviations must be positive");
  RigAdjustment out;
  out.cameras.resize(problem.rig->size());
  out.cameras.front().observed.fill(true);
  solver::BundleState state = solver::state_of(problem);
  const solver::RigValues calibrated = state.rig;
  const auto displaced = [&] {
    return solver::displaced_cameras(state.rig.T_cam_rig, extrinsic_prior(calibrated, options, 1.0));
  };
  CalibrationBlocks blocks = make_blocks(calibrated, options, {});
  if (blocks.size == 0) return out;
  if (start) state.rig = std::move(*start);
  for (std::size_t c = 0; c < options.timing.size(); ++c) {  // constant times are those of the prior
    if (options.timing[c].sigma_shift == 0) state.rig.timing[c].shift_s = options.timing[c].mean.shift_s;
    if (options.timing[c].sigma_readout == 0) state.rig.timing[c].readout_s = options.timing[c].mean.readout_s;
  }
  solver::ReprojectionProblem scaled = problem;
  std::vector<std::uint8_t> skipped, flagged(out.cameras.size(), 0);
  for (const Round& round : kRounds) {
    if (round.kernel == solver::Kernel::kHuber && options.start_is_estimate) continue;
    const std::vector<std::uint8_t> flags = displaced();
    if (flags != flagged) skipped.clear();  // with another prior, no round repeats the one before
    flagged = flags;
    blocks = make_blocks(calibrated, options, flagged);
    if (!run_round(scaled, round, blocks, calibrated, options, stop, skipped, state, out)) return out;
    if (options.sigma_scale > 0)
      out.scale_change *= restore_scale(extrinsic_prior(calibrated, options, 1.0, flagged), scaled, state);
  }
  if (!out.done) return out;
  out.values = std::move(state.rig);
  problem.T_rig_world = std::move(state.T_rig_world);
  problem.points = std::move(state.points);
  problem.motion = std::move(scaled.motion);
  problem.twist = std::move(scaled.twist);
  return out;
}

}  // namespace bslam::calibration
