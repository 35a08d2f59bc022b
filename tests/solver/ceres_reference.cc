#include "solver/ceres_reference.h"

#include <ceres/ceres.h>

#include <cmath>

namespace bslam::solver::ceres_reference {
namespace {

// Poses are left increments [omega, v] of the initial pose: no manifold is needed, and the path to the minimum differs.
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

// The same with the extrinsics as increments on the left, for numeric differentiation.
struct ErrorWithExtrinsics {
  const Rig& rig;
  ReprojectionProblem::Observation observation;
  SE3 pose_start, camera_start;

  bool operator()(const double* pose, const double* point, const double* camera, double* residuals) const {
    const SE3 T_rig_world = SE3::exp(Eigen::Map<const geometry::Vector6d>(pose)) * pose_start;
    const SE3 T_cam_rig = SE3::exp(Eigen::Map<const geometry::Vector6d>(camera)) * camera_start;
    const auto pixel =
        rig.camera(observation.camera).project(T_cam_rig * (T_rig_world * Eigen::Map<const Vector3d>(point)));
    if (!pixel) return false;
    Eigen::Map<Vector2d>{residuals} =
        (observation.pixel.cast<double>() - *pixel) / static_cast<double>(observation.sigma);
    return true;
  }
};

struct PriorError {
  const ExtrinsicPrior& prior;
  std::size_t camera;

  bool operator()(const double* increment, double* residuals) const {
    const SE3& calibrated = prior.T_cam_rig[camera];
    const SE3 T_cam_rig = SE3::exp(Eigen::Map<const geometry::Vector6d>(increment)) * calibrated;
    Eigen::Map<geometry::Vector6d> out(residuals);
    out = extrinsic_change(T_cam_rig, calibrated);
    out.head<3>() /= prior.sigma_rotation;
    const Eigen::Matrix3d covariance = covariance_of(prior, camera).bottomRightCorner<3, 3>();
    covariance.llt().matrixL().solveInPlace(out.tail<3>());
    return true;
  }
};

double solve(ceres::Problem& problem) {
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_SCHUR;
  options.max_num_iterations = 500;
  options.function_tolerance = 1e-15;
  options.gradient_tolerance = 1e-14;
  options.parameter_tolerance = 1e-14;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  return summary.final_cost;
}

}  // namespace

double adjust_with_extrinsics(ReprojectionProblem& problem, const ExtrinsicPrior& prior, std::vector<SE3>& T_cam_rig) {
  std::vector<int> rays(problem.points.size(), 0);
  const std::vector<double> chi2 = squared_errors(problem);
  for (std::size_t i = 0; i < chi2.size(); ++i) {
    rays[static_cast<std::size_t>(problem.observations[i].point)] += chi2[i] < kMaxChi2;
  }
  std::vector<geometry::Vector6d> poses(problem.T_rig_world.size(), geometry::Vector6d::Zero());
  std::vector<geometry::Vector6d> cameras(T_cam_rig.size(), geometry::Vector6d::Zero());
  ceres::Problem ceres_problem;
  for (std::size_t i = 0; i < chi2.size(); ++i) {
    const auto& o = problem.observations[i];
    if (!(chi2[i] < kMaxChi2) || rays[static_cast<std::size_t>(o.point)] < 2) continue;
    const auto pose = static_cast<std::size_t>(o.pose);
    const std::size_t camera = o.camera.index();
    ceres_problem.AddResidualBlock(
        new ceres::NumericDiffCostFunction<ErrorWithExtrinsics, ceres::CENTRAL, 2, 6, 3, 6>(
            new ErrorWithExtrinsics{*problem.rig, o, problem.T_rig_world[pose], T_cam_rig[camera]}),
        new ceres::HuberLoss(std::sqrt(kChi2TwoDof95)), poses[pose].data(),
        problem.points[static_cast<std::size_t>(o.point)].data(), cameras[camera].data());
    if (problem.pose_free[pose] == 0) ceres_problem.SetParameterBlockConstant(poses[pose].data());
    if (camera == 0) ceres_problem.SetParameterBlockConstant(cameras[0].data());
  }
  for (std::size_t c = 1; c < cameras.size(); ++c) {
    ceres_problem.AddResidualBlock(
        new ceres::NumericDiffCostFunction<PriorError, ceres::CENTRAL, 6, 6>(new PriorError{prior, c}), nullptr,
        cameras[c].data());
  }
  const double cost = solve(ceres_problem);
  for (std::size_t c = 1; c < cameras.size(); ++c) T_cam_rig[c] = SE3::exp(cameras[c]) * T_cam_rig[c];
  return cost;
}

double adjust(ReprojectionProblem& problem, bool robust) {
  // Ignores the same observations: those that do not project initially, and points with fewer than two remaining ones.
  std::vector<int> rays(problem.points.size(), 0);
  const std::vector<double> chi2 = squared_errors(problem);
  for (std::size_t i = 0; i < chi2.size(); ++i) {
    rays[static_cast<std::size_t>(problem.observations[i].point)] += chi2[i] < kMaxChi2;
  }
  std::vector<geometry::Vector6d> increments(problem.T_rig_world.size(), geometry::Vector6d::Zero());
  ceres::Problem ceres_problem;
  for (std::size_t i = 0; i < chi2.size(); ++i) {
    const auto& o = problem.observations[i];
    if (!(chi2[i] < kMaxChi2) || rays[static_cast<std::size_t>(o.point)] < 2) continue;
    const auto pose = static_cast<std::size_t>(o.pose);
    ceres_problem.AddResidualBlock(new Cost(problem, o, problem.T_rig_world[pose]),
                                   robust ? new ceres::HuberLoss(std::sqrt(kChi2TwoDof95)) : nullptr,
                                   increments[pose].data(), problem.points[static_cast<std::size_t>(o.point)].data());
    if (problem.pose_free[pose] == 0) ceres_problem.SetParameterBlockConstant(increments[pose].data());
  }
  const double cost = solve(ceres_problem);
  for (std::size_t i = 0; i < increments.size(); ++i) {
    if (problem.pose_free[i] != 0) problem.T_rig_world[i] = SE3::exp(increments[i]) * problem.T_rig_world[i];
  }
  return cost;
}

}  // namespace bslam::solver::ceres_reference
