#include "solver/bundle_adjuster.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/assert.h"
#include "solver/bundle_equations.h"

namespace bslam::solver {
namespace {

// Damping of Levenberg-Marquardt in shares of the diagonal, updated as in Nielsen, "Damping parameter in Marquardt's
// method", IMM-REP-1999-05. The lower bound keeps the 3x3 blocks of points without parallax invertible.
class Damping {
 public:
  double value() const { return value_; }
  bool exhausted() const { return value_ > kMax; }
  // `gain` is actual over predicted decrease.
  void accept(double gain) {
    const double bend = 2.0 * gain - 1.0;
    value_ = std::max(kMin, value_ * std::max(1.0 / 3.0, 1.0 - bend * bend * bend));
    growth_ = 2.0;
  }
  void reject() {
    value_ *= growth_;
    growth_ *= 2.0;
  }

 private:
  static constexpr double kFirst = 1e-4, kMin = 1e-10, kMax = 1e16;
  double value_ = kFirst, growth_ = 2.0;
};

constexpr double kMinGain = 1e-3;      // of the predicted decrease, below which a step is not worth taking
constexpr double kNegligible = 1e-10;  // share of the cost that rounding alone may change, and absolute cost of nothing

bool any_free(const ReprojectionProblem& problem) {
  return std::any_of(problem.pose_free.begin(), problem.pose_free.end(), [](std::uint8_t free) { return free != 0; });
}
bool any_fixed(const ReprojectionProblem& problem) {
  return std::any_of(problem.pose_free.begin(), problem.pose_free.end(), [](std::uint8_t free) { return free == 0; });
}

// The loop of Levenberg-Marquardt from and to `state`.
void minimise(BundleEquations& equations, const BundleOptions& options, const std::stop_token& stop, BundleState& state,
              BundleSummary& summary) {
  Damping damping;
  BundleState trial = state;
  double cost = equations.linearise(state);
  summary.initial_cost = summary.final_cost = cost;
  if (!std::isfinite(cost)) return;
  summary.stop = BundleStop::kIterations;
  bool any_solved = options.iterations == 0;
  for (int i = 0; i < options.iterations; ++i) {
    if (stop.stop_requested()) {
      summary.stop = BundleStop::kStopped;
      return;
    }
    BundleEquations::Step step;
    const bool solved = equations.solve(damping.value(), state, trial, step);
    any_solved |= solved;
    const double negligible = kNegligible * (1.0 + cost);
    if (solved && step.predicted <= negligible) {
      summary.stop = BundleStop::kConverged;
      return;
    }
    const double trial_cost = solved ? equations.cost(trial) : std::numeric_limits<double>::infinity();
    const double gain = (cost - trial_cost) / step.predicted;
    const bool accepted = solved && gain > kMinGain;
    summary.steps.push_back({accepted ? trial_cost : cost, damping.value(), step.norm, accepted});
    if (!accepted) {
      damping.reject();
      if (damping.exhausted()) {
        summary.stop = any_solved ? BundleStop::kConverged : BundleStop::kFailed;
        return;
      }
      continue;
    }
    const bool converged = cost - trial_cost <= options.relative_decrease * cost;
    damping.accept(gain);
    std::swap(state, trial);
    summary.final_cost = cost = trial_cost;
    if (converged) {
      summary.stop = BundleStop::kConverged;
      return;
    }
    if (i + 1 < options.iterations) equations.linearise(state);
  }
  if (!any_solved) summary.stop = BundleStop::kFailed;
}

}  // namespace

BundleSummary adjust(ReprojectionProblem& problem, const BundleOptions& options, std::span<const std::uint8_t> skip,
                     std::stop_token stop) {
  BSLAM_ASSERT(!any_free(problem) || any_fixed(problem), "one pose at least is fixed: it holds the gauge");
  const BundleStructure structure = make_structure(problem, skip);
  BundleSummary summary;
  if (structure.num_points() == 0) return summary;  // nothing to learn from
  BundleEquations equations(problem, structure, options.robust ? Kernel::kHuber : Kernel::kNone,
                            options.dense_poses);
  BundleState state{problem.T_rig_world, problem.points};
  minimise(equations, options, stop, state, summary);
  if (summary.usable()) {
    problem.T_rig_world = std::move(state.T_rig_world);
    problem.points = std::move(state.points);
  }
  return summary;
}

SE3 cam_from_rig_at(const ReprojectionProblem& problem, std::size_t pose, CameraIndex camera) {
  const SE3& T_cam_rig = problem.rig->cam_from_rig(camera);
  return problem.motion.empty() ? T_cam_rig : T_cam_rig * problem.motion[pose * problem.rig->size() + camera.index()];
}

std::vector<double> squared_errors(const ReprojectionProblem& problem) {
  std::vector<SE3> T_cam_rig;
  for (std::size_t i = 0; i < problem.rig->size(); ++i) T_cam_rig.push_back(problem.rig->cam_from_rig(i));
  return squared_errors(problem, problem.T_rig_world, problem.points, T_cam_rig);
}

std::vector<std::uint8_t> beyond(const std::vector<double>& chi2, double bound) {
  std::vector<std::uint8_t> out(chi2.size());
  for (std::size_t i = 0; i < chi2.size(); ++i) out[i] = !(chi2[i] <= bound);
  return out;
}

std::vector<double> squared_errors(const ReprojectionProblem& problem, std::span<const SE3> T_rig_world,
                                   std::span<const Vector3d> points, std::span<const SE3> T_cam_rig) {
  std::vector<double> out;
  out.reserve(problem.observations.size());
  for (const ReprojectionProblem::Observation& o : problem.observations) {
    const auto pose = static_cast<std::size_t>(o.pose);
    Vector3d point_rig = T_rig_world[pose] * points[static_cast<std::size_t>(o.point)];
    if (!problem.motion.empty()) point_rig = problem.motion[pose * problem.rig->size() + o.camera.index()] * point_rig;
    const auto pixel = problem.rig->camera(o.camera).project(T_cam_rig[o.camera.index()] * point_rig);
    const double sigma = static_cast<double>(o.sigma);
    out.push_back(pixel ? (o.pixel.cast<double>() - *pixel).squaredNorm() / (sigma * sigma)
                        : std::numeric_limits<double>::infinity());
  }
  return out;
}

}  // namespace bslam::solver
