#include "solver/ceres_reference.h"

#include <cmath>

#include <ceres/ceres.h>

namespace bslam::solver::ceres_reference {
namespace {

// Poses as increments [omega, v] on the left of the start pose: no manifold needed, and another path to the minimum.
class Cost : public ceres::SizedCostFunction<2, 6, 3> {
 public:
  Cost(const ReprojectionProblem& problem, const ReprojectionProblem::Observation& o, const SE3& start)
      : rig_(*problem.rig), observation_(o), start_(start) {}

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const Eigen::Map<const geometry::Vector6d> xi(parameters[0]);
    const Eigen::Map<const Vector3d> point(parameters[1]);
    const SE3 T = SE3::exp(xi) * start_;
    const auto r =
        ReprojectionResidual::evaluate(rig_, observation_.camera, T, point, observation_.pixel.cast<double>());
    if (!r) return false;
    const double scale = 1.0 / static_cast<double>(observation_.sigma);
    Eigen::Map<Vector2d> error(residuals);
    error = scale * r->error;
    if (jacobians == nullptr) return true;
    if (jacobians[0] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 2, 6, Eigen::RowMajor>> J(jacobians[0]);
      J = scale * r->J_pose * left_jacobian(xi);
    }
    if (jacobians[1] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 2, 3, Eigen::RowMajor>> J(jacobians[1]);
      J = scale * r->J_point;
    }
    return true;
  }

 private:
  // exp(xi + d) = exp(J d) exp(xi), by central differences: xi is small and the minimum does not depend on it.
  static geometry::Matrix6d left_jacobian(const geometry::Vector6d& xi) {
    constexpr double kStep = 1e-5;
    geometry::Matrix6d J;
    const SE3 back = SE3::exp(xi).inverse();
    for (int k = 0; k < 6; ++k) {
      const geometry::Vector6d d = kStep * geometry::Vector6d::Unit(k);
      J.col(k) = ((SE3::exp(xi + d) * back).log() - (SE3::exp(xi - d) * back).log()) / (2 * kStep);
    }
    return J;
  }

  const Rig& rig_;
  ReprojectionProblem::Observation observation_;
  SE3 start_;
};

}  // namespace

double adjust(ReprojectionProblem& problem, bool robust) {
  // Left out as by our own: what does not project at the start, and points with less than two observations then.
  std::vector<int> rays(problem.points.size(), 0);
  const std::vector<double> chi2 = squared_errors(problem);
  for (std::size_t i = 0; i < chi2.size(); ++i) {
    rays[static_cast<std::size_t>(problem.observations[i].point)] += chi2[i] < kLostChi2;
  }
  std::vector<geometry::Vector6d> increments(problem.T_rig_world.size(), geometry::Vector6d::Zero());
  ceres::Problem ceres_problem;
  for (std::size_t i = 0; i < chi2.size(); ++i) {
    const auto& o = problem.observations[i];
    if (!(chi2[i] < kLostChi2) || rays[static_cast<std::size_t>(o.point)] < 2) continue;
    const auto pose = static_cast<std::size_t>(o.pose);
    ceres_problem.AddResidualBlock(new Cost(problem, o, problem.T_rig_world[pose]),
                                   robust ? new ceres::HuberLoss(std::sqrt(kChi2TwoDof95)) : nullptr,
                                   increments[pose].data(), problem.points[static_cast<std::size_t>(o.point)].data());
    if (problem.pose_free[pose] == 0) ceres_problem.SetParameterBlockConstant(increments[pose].data());
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_SCHUR;
  options.max_num_iterations = 500;
  options.function_tolerance = 1e-15;
  options.gradient_tolerance = 1e-14;
  options.parameter_tolerance = 1e-14;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &ceres_problem, &summary);
  for (std::size_t i = 0; i < increments.size(); ++i) {
    if (problem.pose_free[i] != 0) problem.T_rig_world[i] = SE3::exp(increments[i]) * problem.T_rig_world[i];
  }
  return summary.final_cost;
}

}  // namespace bslam::solver::ceres_reference
