// Levenberg-Marquardt algorithm, used by the optimisations of all folders (docs/math.md, section 3).
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <concepts>
#include <cstdint>
#include <limits>
#include <optional>
#include <stop_token>
#include <utility>

#include "base/work.h"

namespace bslam::solver {

enum class DampingRule {
  kNielsen,    // depends on the ratio of actual to predicted decrease (Nielsen, IMM-REP-1999-05)
  kOnFailure,  // no damping (Gauss-Newton) until a step fails; then times 10 after a failure, times 1/10 after a
               // success
};

struct LmOptions {
  int iterations = 10;              // maximum number of steps, accepted or rejected
  double relative_decrease = 1e-4;  // converged if a step decreases the cost by a smaller fraction
  double step_tolerance = 0.0;      // standard deviations; converged if an undamped step is shorter
  double min_gain = 1e-3;           // minimum ratio of actual to predicted decrease of an accepted step
  DampingRule rule = DampingRule::kNielsen;
  double first_damping = 1e-4;  // factor of the diagonal, initially or after the first failure
  // Cost of a residual as large as its noise; changes of the cost below 1e-10 of it are ignored.
  double unit_cost = 1.0;
};

enum class LmStop { kConverged, kIterations, kStopped, kFailed };

struct LmSummary {
  LmStop stop = LmStop::kFailed;  // kFailed: the initial cost is not finite, or no linear system could be solved
  double initial_cost = 0, final_cost = 0;
  int iterations = 0;  // number of steps, accepted or rejected
  bool usable() const { return stop != LmStop::kFailed; }
};

// A problem stores its current values and those of a trial step.
template <class P>
concept LeastSquaresProblem = requires(P p, double damping) {
  // Builds the normal equations H delta = b at the current values and returns their cost.
  { p.linearise() } -> std::same_as<double>;
  // Solves (H + damping D) delta = b, D the diagonal of H, for the trial values. Returns the decrease of the cost that
  // the quadratic model predicts, or nullopt if the system cannot be solved.
  { p.solve(damping) } -> std::same_as<std::optional<double>>;
  { p.trial_cost() } -> std::same_as<double>;
  // The trial values become the current ones. After a Gauss-Newton step that ends the loop, trial_cost() was not
  // called.
  p.accept();
};

class Damping {
 public:
  explicit Damping(const LmOptions& options)
      : rule_(options.rule), first_(options.first_damping), value_(rule_ == DampingRule::kNielsen ? first_ : 0.0) {}

  double value() const { return value_; }
  bool exhausted() const { return value_ > 1e16; }

  // `gain`: actual over predicted decrease.
  void accept(double gain) {
    constexpr double kMin = 1e-10;  // keeps the blocks of points without parallax invertible
    const double relative_gain = 2.0 * gain - 1.0;
    if (rule_ == DampingRule::kNielsen) {
      value_ = std::max(kMin, value_ * std::max(1.0 / 3.0, 1.0 - relative_gain * relative_gain * relative_gain));
    } else {
      value_ = value_ > first_ ? 0.1 * value_ : 0.0;
    }
    growth_ = 2.0;
  }
  void reject() {
    value_ = rule_ == DampingRule::kNielsen ? value_ * growth_ : std::max(first_, 10.0 * value_);
    growth_ *= 2.0;
  }

 private:
  DampingRule rule_;
  double first_, value_, growth_ = 2.0;
};

// Minimises the cost until convergence, the maximum number of iterations, or a stop request. The normal equations are
// built once per accepted step, except for the last one.
template <LeastSquaresProblem Problem>
LmSummary minimise(Problem& problem, const LmOptions& options, const std::stop_token& stop = {}) {
  constexpr double kRounding = 1e-10;  // fraction of the cost, and of unit_cost, that rounding alone may change
  LmSummary out;
  double& cost = out.final_cost;
  out.initial_cost = cost = problem.linearise();
  if (!std::isfinite(cost)) return out;
  const auto end = [&](LmStop reason) {
    count_solver_steps(static_cast<std::uint64_t>(out.iterations));
    return out.stop = reason, out;
  };
  Damping damping(options);
  bool any_solved = options.iterations == 0;
  while (out.iterations < options.iterations) {
    if (stop.stop_requested()) return end(LmStop::kStopped);
    ++out.iterations;
    const std::optional<double> predicted = problem.solve(damping.value());
    any_solved |= predicted.has_value();
    if (predicted && damping.value() <= 0.0 && 2.0 * *predicted < options.step_tolerance * options.step_tolerance) {
      problem.accept();
      cost -= *predicted;
      return end(LmStop::kConverged);
    }
    if (predicted && *predicted <= kRounding * (options.unit_cost + cost)) return end(LmStop::kConverged);
    const double trial = predicted ? problem.trial_cost() : std::numeric_limits<double>::infinity();
    const double decrease = cost - trial;
    if (!predicted || !(decrease >= options.min_gain * *predicted)) {
      damping.reject();
      if (damping.exhausted()) return end(any_solved ? LmStop::kConverged : LmStop::kFailed);
      continue;
    }
    damping.accept(decrease / *predicted);
    problem.accept();
    const bool converged = decrease <= options.relative_decrease * cost;
    cost = trial;
    if (converged) return end(LmStop::kConverged);
    if (out.iterations < options.iterations) problem.linearise();
  }
  return end(any_solved ? LmStop::kIterations : LmStop::kFailed);
}

// H delta = b in N unknowns, and the cost at the values of the linearisation.
template <int N>
struct NormalEquations {
  Eigen::Matrix<double, N, N> H = Eigen::Matrix<double, N, N>::Zero();
  Eigen::Matrix<double, N, 1> b = Eigen::Matrix<double, N, 1>::Zero();
  double cost = 0.0;
};

// A problem of a few unknowns whose equations are computed together with its cost: `linearise(state)` returns
// NormalEquations<N>, `plus(state, delta)` the state after a step.
template <int N, class State, class Linearise, class Plus>
class SmallProblem {
 public:
  // `at_start`: the equations at the initial state `start`.
  SmallProblem(const State& start, const NormalEquations<N>& at_start, Linearise linearise, Plus plus)
      : linearise_(std::move(linearise)), plus_(std::move(plus)), state_(start), trial_(start), equations_(at_start) {}

  double linearise() { return equations_.cost; }  // built by trial_cost()
  std::optional<double> solve(double damping) {
    constexpr double kRidge = 1e-9;  // relative to the largest diagonal entry; regularises undetermined directions
    Eigen::Matrix<double, N, N> damped = equations_.H;
    damped.diagonal() *= 1.0 + damping;
    damped.diagonal().array() += kRidge * equations_.H.diagonal().maxCoeff();
    const Eigen::Matrix<double, N, 1> delta = damped.ldlt().solve(equations_.b);
    if (!delta.allFinite()) return std::nullopt;
    trial_ = plus_(state_, delta);
    return 0.5 * (delta.dot(equations_.b) + damping * delta.cwiseAbs2().dot(equations_.H.diagonal()));
  }
  double trial_cost() { return (at_trial_ = linearise_(trial_)).cost; }
  void accept() {
    state_ = trial_;
    equations_ = at_trial_;
  }

  const State& state() const { return state_; }

 private:
  Linearise linearise_;
  Plus plus_;
  State state_, trial_;
  NormalEquations<N> equations_, at_trial_;
};

}  // namespace bslam::solver
