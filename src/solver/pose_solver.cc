#include "solver/pose_solver.h"

#include <Eigen/Eigenvalues>
#include <algorithm>

#include "solver/pose_problem.h"

namespace bslam::solver {
namespace {

using geometry::Matrix6d;
using geometry::Vector6d;

// Maximum standard deviation of a pose in any direction: radians, and relative to the distance of the points. A valid
// pose from ten points has less than a tenth of it; for points along one ray it is much larger.
constexpr double kMaxDeviation = 0.05;

// Convergence tolerances in standard deviations of the pose, between rounds and for the last round.
constexpr double kRoundTolerance = 0.1, kFinalTolerance = 1e-3;

// Unit of translations relative to rotations: the harmonic mean distance, which far points hardly influence.
double typical_distance(const PoseProblem& problem, const SE3& T_rig_world) {
  double inverse = 0.0;
  int count = 0;
  for (const PoseProblem::Item& item : problem.items()) {
    if (!item.in_use) continue;
    inverse += 1.0 / std::max(1e-3, (T_rig_world * item.point_world).norm());
    ++count;
  }
  return count > 0 ? count / inverse : 1.0;
}

bool well_conditioned(const Matrix6d& information, double distance) {
  Vector6d unit = Vector6d::Ones();
  unit.tail<3>().setConstant(distance);
  const Matrix6d scaled = unit.asDiagonal() * information * unit.asDiagonal();
  const double smallest = Eigen::SelfAdjointEigenSolver<Matrix6d>(scaled, Eigen::EigenvaluesOnly).eigenvalues()(0);
  return smallest * kMaxDeviation * kMaxDeviation > 1.0;
}

PoseSolution report(PoseProblem& problem, const SE3& T_rig_world, const PoseSolverOptions& options) {
  int changed = 0;
  const PoseEquations equations = problem.reselect_and_linearise(T_rig_world, Kernel::kNone, kChi2TwoDof95, changed);
  PoseSolution out;
  out.T_rig_world = T_rig_world;
  out.information = 0.5 * (equations.H + equations.H.transpose());
  out.num_inliers = problem.num_in_use();
  out.inlier.assign(problem.items().size(), 0);
  out.inliers_per_camera.assign(problem.rig().size(), 0);
  for (const PoseProblem::Item& item : problem.items()) {
    out.inlier[static_cast<std::size_t>(item.observation)] = item.in_use;
    out.inliers_per_camera[item.camera.index()] += item.in_use;
  }
  out.ok = out.num_inliers >= options.min_inliers && out.num_inliers >= 3 && T_rig_world.translation().allFinite() &&
           well_conditioned(out.information, typical_distance(problem, T_rig_world));
  return out;
}

}  // namespace

PoseSolution solve_rounds(PoseProblem& problem, const SE3& T_rig_world, double first_bound,
                          const PoseSolverOptions& options) {
  SE3 T = T_rig_world;
  for (int round = 0; round < options.rounds; ++round) {
    int changed = 0;
    const PoseEquations equations =
        problem.reselect_and_linearise(T, Kernel::kHuber, round == 0 ? first_bound : kChi2TwoDof95, changed);
    if (problem.num_in_use() < 3) break;
    // After a reclassification all items in use are within the quadratic part of the kernel, so that the equations are
    // the same without kernel. Rounds without changes are skipped.
    const bool last = round > 0 && (round == options.rounds - 1 || changed == 0);
    T = refine_pose(problem, T, equations, last ? Kernel::kNone : Kernel::kHuber, options.iterations,
                    last || options.rounds == 1 ? kFinalTolerance : kRoundTolerance);
    if (last) break;
  }
  return report(problem, T, options);
}

PoseSolution solve_pose(const Rig& rig, std::span<const PoseObservation> observations, const SE3& T_rig_world_initial,
                        const PoseSolverOptions& options) {
  PoseProblem problem(rig, observations);
  return solve_rounds(problem, T_rig_world_initial, options.first_chi2, options);
}

PoseSolution solve_pose(const Rig& rig, std::span<const PoseObservation> observations, const SE3& T_rig_world_initial,
                        const MotionModel& motion, const PoseSolverOptions& options) {
  PoseProblem problem(rig, observations, &motion);
  return solve_rounds(problem, T_rig_world_initial, options.first_chi2, options);
}

}  // namespace bslam::solver
