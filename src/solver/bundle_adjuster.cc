#include "solver/bundle_adjuster.h"

#include <algorithm>
#include <limits>

#include "base/assert.h"
#include "solver/bundle_equations.h"

namespace bslam::solver {

namespace {

// Rig blocks for the extrinsics in radians and metres and the intrinsics in the units of the models. The blocks contain
// priors, which the caller must subtract from the information.
RigBlocks calibration_blocks(const RigValues& rig) {
  IntrinsicPrior intrinsics;
  for (const camera::CameraModel& model : rig.models) {
    const camera::ModelParameters values = camera::parameters(model);
    intrinsics.values.push_back(values);
    intrinsics.sigmas.push_back(camera::ModelParameters::Ones(values.size()));
  }
  RigBlocks blocks;
  blocks.push_back(std::make_unique<ExtrinsicsBlock>(
      ExtrinsicPrior{.T_cam_rig = rig.T_cam_rig, .sigma_rotation = 1.0, .sigma_translation = 1.0}));
  blocks.push_back(std::make_unique<IntrinsicsBlock>(std::move(intrinsics)));
  return blocks;
}

// Flags all observations but those of every n-th point, with n such that about kPointsPerPose points per free pose
// remain. `skip` is empty or flags observations that are ignored anyway.
std::vector<std::uint8_t> thinned_out(const ReprojectionProblem& problem, const BundleStructure& structure,
                                      std::span<const std::uint8_t> skip) {
  constexpr std::size_t kPointsPerPose = 50;
  const std::size_t wanted = kPointsPerPose * structure.pose_of_slot.size();
  const std::size_t every = std::max<std::size_t>(1, structure.num_points() / std::max<std::size_t>(1, wanted));
  std::vector<std::uint8_t> out(skip.begin(), skip.end());
  out.resize(problem.observations.size(), 0);
  for (std::size_t i = 0; i < out.size(); ++i)
    out[i] |= static_cast<std::size_t>(problem.observations[i].point) % every != 0;
  return out;
}

// Computes L of BundleOptions::rig_prior from the factorised equations of all points with these blocks. Corrects for
// the outlier bound, which makes the noise and the information of the inliers look better than they are. Nullopt if the
// equations are singular with the prior.
std::optional<Eigen::MatrixXd> deviation_after(const BundleOptions& options, const RigBlocks& blocks,
                                               const BundleEquations& equations) {
  const ReducedSystem::RigEquations rig = equations.rig_equations();
  const Eigen::MatrixXd of_images = rig.information - information_of_prior(blocks, equations.state().rig);
  constexpr double kTruncation = kVarianceLeft / kFractionLeft;
  const double weight = kTruncation * kTruncation / options.correlated_observations;
  const Eigen::LLT<Eigen::MatrixXd> factor(weight * of_images + *options.rig_prior);
  if (factor.info() != Eigen::Success) return std::nullopt;
  const Eigen::Index n = rig.rhs.size();
  Eigen::MatrixXd L(n, n + 1);
  L.leftCols(n) = factor.matrixU().solve(Eigen::MatrixXd::Identity(n, n));
  L.col(n) = factor.solve(weight * rig.rhs);
  return L;
}

// The effect of the known deviation of the rig if the fixed poses depend on it.
std::vector<std::optional<geometry::PoseUncertainty::Effect>> effects_beside_fixed_poses(
    ReprojectionProblem problem, const BundleOptions& options, Kernel kernel, const BundleState& state,
    const std::vector<double>& chi2, std::span<const std::uint8_t> skip) {
  problem.pose_free.assign(problem.T_rig_world.size(), 1);
  const BundleStructure all = make_structure(problem, chi2, skip);
  const RigBlocks calibration = calibration_blocks(state.rig);
  BundleEquations equations(problem, all, calibration, kernel, options.dense_poses, state);
  equations.linearise();
  return equations.rig_effects(options.marginals, *options.rig_deviation, options.fixed_effects);
}

// The effect of the deviation of the rig on the poses, -S^-1 B L. S and B both grow in proportion to the number of
// points, so that a subset of the points suffices if the deviation is known.
std::vector<std::optional<geometry::PoseUncertainty::Effect>> effects_of_rig(
    const ReprojectionProblem& problem, const BundleStructure& structure, const BundleOptions& options, Kernel kernel,
    const BundleState& state, const std::vector<double>& chi2, std::span<const std::uint8_t> skip) {
  const std::vector<std::optional<geometry::PoseUncertainty::Effect>> unknown(options.marginals.size());
  const bool known = options.rig_deviation != nullptr;
  if (known && !options.fixed_effects.empty())
    return effects_beside_fixed_poses(problem, options, kernel, state, chi2, thinned_out(problem, structure, skip));
  const BundleStructure some = known ? make_structure(problem, chi2, thinned_out(problem, structure, skip)) : structure;
  const RigBlocks calibration = calibration_blocks(state.rig);
  BundleEquations equations(problem, some, calibration, kernel, options.dense_poses, state);
  equations.linearise();
  if (!equations.factorise()) return unknown;
  if (known) return equations.rig_effects(options.marginals, *options.rig_deviation);
  const auto deviation = deviation_after(options, calibration, equations);
  return deviation ? equations.rig_effects(options.marginals, *deviation) : unknown;
}

// The uncertainty of the poses, whose rig is constant: the noise at the values where `adjusted` was linearised last,
// the effect of the rig at its final values.
std::vector<std::optional<geometry::PoseUncertainty>> uncertainties_of(
    const ReprojectionProblem& problem, const BundleStructure& structure, const BundleOptions& options, Kernel kernel,
    const std::vector<double>& chi2, std::span<const std::uint8_t> skip, BundleEquations& adjusted) {
  if (options.marginals.empty()) return {};
  const auto noise = adjusted.pose_covariances(options.marginals);
  std::vector<std::optional<geometry::PoseUncertainty::Effect>> effect(noise.size(),
                                                                       geometry::PoseUncertainty::Effect(6, 0));
  if (options.rig_deviation || options.rig_prior)
    effect = effects_of_rig(problem, structure, options, kernel, adjusted.state(), chi2, skip);
  std::vector<std::optional<geometry::PoseUncertainty>> out(noise.size());
  for (std::size_t i = 0; i < out.size(); ++i) {
    if (noise[i] && effect[i]) out[i] = geometry::PoseUncertainty{*noise[i], *effect[i]};
  }
  return out;
}

}  // namespace

BundleSummary adjust(ReprojectionProblem& problem, const BundleOptions& options, std::span<const std::uint8_t> skip,
                     std::stop_token stop) {
  const std::vector<double> chi2 = squared_errors(problem);
  BSLAM_ASSERT(problem.pose_free.empty() || std::ranges::find(problem.pose_free, 0) != problem.pose_free.end(),
               "at least one pose must be fixed");
  BSLAM_ASSERT(options.fixed_effects.empty() || options.fixed_effects.size() == problem.T_rig_world.size(),
               "fixed_effects must have one entry per pose");
  const BundleStructure structure = make_structure(problem, chi2, skip);
  if (structure.num_points() == 0) return {};
  const Kernel kernel = options.robust ? Kernel::kHuber : Kernel::kNone;
  const RigBlocks constant_rig;
  BundleEquations equations(problem, structure, constant_rig, kernel, options.dense_poses, state_of(problem));
  BundleSummary summary{
      minimise(equations, {.iterations = options.iterations, .relative_decrease = options.relative_decrease}, stop),
      {}};
  if (summary.usable()) {
    summary.uncertainties = uncertainties_of(problem, structure, options, kernel, chi2, skip, equations);
    problem.T_rig_world = std::move(equations.state().T_rig_world);
    problem.points = std::move(equations.state().points);
  }
  return summary;
}

void check_problem(const ReprojectionProblem& problem) {
  using Observation = ReprojectionProblem::Observation;
  BSLAM_ASSERT(problem.rig != nullptr, "the problem must have a rig");
  const std::size_t poses = problem.T_rig_world.size();
  BSLAM_ASSERT(problem.pose_free.size() == poses, "pose_free must have one entry per pose");
  BSLAM_ASSERT(problem.motion.empty() || problem.motion.size() == poses * problem.rig->size(),
               "motion must have one entry per pose and camera");
  BSLAM_ASSERT(problem.twist.empty() || problem.twist.size() == poses, "twist must have one entry per pose");
  const Observation* last = nullptr;
  for (const Observation& o : problem.observations) {
    BSLAM_ASSERT(o.pose >= 0 && o.pose < static_cast<int>(poses) && o.point >= 0 &&
                     o.point < static_cast<int>(problem.points.size()),
                 "an observation must refer to a pose and a point of the problem");
    BSLAM_ASSERT(o.camera.valid() && o.camera.index() < problem.rig->size(),
                 "an observation must refer to a camera of the rig");
    BSLAM_ASSERT(o.sigma > 0, "standard deviations must be positive");
    BSLAM_ASSERT(
        last == nullptr || last->point < o.point ||
            (last->point == o.point && (last->pose < o.pose || (last->pose == o.pose && last->camera <= o.camera))),
        "observations must be sorted by point, pose and camera");
    last = &o;
  }
}

Vector3d point_in_camera(const ReprojectionProblem& problem, const RigValues& rig,
                         const ReprojectionProblem::Observation& o, std::size_t camera, const Vector3d& point_rig) {
  const auto pose = static_cast<std::size_t>(o.pose);
  const SE3& T_cam_rig = rig.T_cam_rig[camera];
  const SE3* motion = problem.motion.empty() ? nullptr : &problem.motion[pose * problem.rig->size() + camera];
  const Vector3d point_cam = T_cam_rig * (motion ? *motion * point_rig : point_rig);
  if (problem.twist.empty()) return point_cam;
  const camera::Shutter shutter(problem.rig->camera(camera), rig.timing[camera],
                                motion ? T_cam_rig * *motion : T_cam_rig, problem.twist[pose]);
  return shutter.at_row(point_cam, static_cast<double>(o.pixel.y()));
}

Vector3d point_in_camera(const ReprojectionProblem& problem, const RigValues& rig,
                         const ReprojectionProblem::Observation& o, std::size_t camera) {
  const Vector3d point_rig =
      problem.T_rig_world[static_cast<std::size_t>(o.pose)] * problem.points[static_cast<std::size_t>(o.point)];
  return point_in_camera(problem, rig, o, camera, point_rig);
}

std::vector<double> squared_errors(const ReprojectionProblem& problem) {
  BSLAM_ASSERT(problem.rig != nullptr, "the problem must have a rig");
  return squared_errors(problem, problem.T_rig_world, problem.points, RigValues::of(*problem.rig));
}

std::vector<std::uint8_t> beyond(const std::vector<double>& chi2, double bound) {
  std::vector<std::uint8_t> out(chi2.size());
  for (std::size_t i = 0; i < chi2.size(); ++i) out[i] = !(chi2[i] <= bound);
  return out;
}

std::vector<double> squared_errors(const ReprojectionProblem& problem, std::span<const SE3> T_rig_world,
                                   std::span<const Vector3d> points, const RigValues& rig) {
  check_problem(problem);
  BSLAM_ASSERT(T_rig_world.size() == problem.T_rig_world.size() && points.size() == problem.points.size(),
               "there must be one pose and one point for each of the problem's");
  std::vector<double> out;
  out.reserve(problem.observations.size());
  for (const ReprojectionProblem::Observation& o : problem.observations) {
    const Vector3d point_rig =
        T_rig_world[static_cast<std::size_t>(o.pose)] * points[static_cast<std::size_t>(o.point)];
    const Vector3d point_cam = point_in_camera(problem, rig, o, o.camera.index(), point_rig);
    const auto error = residual_error(rig.models[o.camera.index()], point_cam, o.pixel.cast<double>());
    const double sigma = static_cast<double>(o.sigma);
    out.push_back(error ? error->squaredNorm() / (sigma * sigma) : std::numeric_limits<double>::infinity());
  }
  return out;
}

}  // namespace bslam::solver
