#include "looping/pose_graph.h"

#include <ceres/ceres.h>
#include <ceres/rotation.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>

#include "solver/scene.h"

namespace bslam::looping {
namespace {

using geometry::Quaterniond;
using geometry::Sim3;
using geometry::Vector3d;
using geometry::Vector7d;
using solver::LmStop;
using solver::LmSummary;

constexpr bool kScaleFree = true, kRigid = false;

Vector7d noise(Random& random, const PoseGraphOptions& sigma, bool free_scale) {
  Vector7d out;
  for (int k = 0; k < 7; ++k) out(k) = random.normal() * (k < 3 ? sigma.sigma_rotation : sigma.sigma_translation);
  out(6) = free_scale ? sigma.sigma_log_scale * random.normal() : 0.0;
  return out;
}

// Once around a circle of 10 m, looking ahead. Every vertex is connected to the `neighbours` before it with noise and,
// if `closed`, the last to the first. The initial values are the odometry: the concatenated edges to the previous
// vertices.
struct Circle {
  PoseGraphProblem problem;
  std::vector<Sim3> truth;
};

Circle make_circle(int count, int neighbours, bool closed, bool free_scale, double noise_factor, Random& random,
                   double scale_drift = 0.0) {
  Circle out;
  out.problem.free_scale = free_scale;
  const PoseGraphOptions sigma;
  for (int i = 0; i < count; ++i) {
    const double yaw = 2 * std::numbers::pi * i / count;
    const Quaterniond R(Eigen::AngleAxisd(yaw, Vector3d::UnitY()));
    const Sim3 S_world_i(1.0, R, Vector3d(10 - 10 * std::cos(yaw), 0.2 * std::sin(3 * yaw), 10 * std::sin(yaw)));
    out.truth.push_back(S_world_i.inverse());
    out.problem.fixed.push_back(i == 0);
  }
  const auto link = [&](int a, int b, double log_scale) {
    const auto& S = out.truth;
    Vector7d off = noise_factor * noise(random, sigma, free_scale);
    off(6) += log_scale;
    const Sim3 S_a_b = S[static_cast<std::size_t>(a)] * S[static_cast<std::size_t>(b)].inverse() * Sim3::exp(off);
    out.problem.edges.push_back({a, b, S_a_b, 1.0});
  };
  for (int i = 1; i < count; ++i) {
    for (int k = 1; k <= neighbours && k <= i; ++k) link(i, i - k, k * scale_drift);
  }
  out.problem.S_world = out.truth;
  for (int i = 1, e = 0; i < count; e += std::min(neighbours, i), ++i) {
    const auto v = static_cast<std::size_t>(i);
    out.problem.S_world[v] = out.problem.edges[static_cast<std::size_t>(e)].S_a_b * out.problem.S_world[v - 1];
  }
  if (closed) {
    for (int k = 0; k < neighbours; ++k) link(k, count - 1, 0.0);
  }
  return out;
}

Vector3d centre(const Sim3& S_i_world) { return S_i_world.inverse().translation(); }

double rms_centre_error(const std::vector<Sim3>& S_world, const std::vector<Sim3>& truth) {
  double sum = 0.0;
  for (std::size_t i = 0; i < truth.size(); ++i) sum += (centre(S_world[i]) - centre(truth[i])).squaredNorm();
  return std::sqrt(sum / static_cast<double>(truth.size()));
}

void expect_equal(const Sim3& x, const Sim3& y) {
  EXPECT_EQ(x.rotation().coeffs(), y.rotation().coeffs());
  EXPECT_EQ(x.translation(), y.translation());
  EXPECT_EQ(x.scale(), y.scale());
}

TEST(PoseGraph, RecoversTruthFromExactEdges) {
  for (const bool free_scale : {kRigid, kScaleFree}) {
    Random random(1);
    Circle circle = make_circle(60, 3, true, free_scale, 0.0, random);
    for (std::size_t i = 1; i < circle.truth.size(); ++i) {
      Vector7d off;
      off << solver::scene::random_twist(random, 0.3, 1.0), free_scale ? random.uniform(-0.3, 0.3) : 0.0;
      circle.problem.S_world[i] = circle.problem.S_world[i].perturbed(off);
    }
    const LmSummary summary = optimise(circle.problem, {});
    EXPECT_EQ(summary.stop, LmStop::kConverged);
    EXPECT_LT(summary.final_cost, 1e-8);
    for (std::size_t i = 0; i < circle.truth.size(); ++i) {
      EXPECT_LT((circle.problem.S_world[i] * circle.truth[i].inverse()).log().norm(), 1e-6) << i;
    }
  }
}

TEST(PoseGraph, ClosesALoopOfARigidRig) {
  Random random(2);
  double before = 0.0, after = 0.0;
  for (int trial = 0; trial < 10; ++trial) {
    Circle circle = make_circle(120, 1, true, kRigid, 1.0, random);
    before += rms_centre_error(circle.problem.S_world, circle.truth);
    ASSERT_TRUE(optimise(circle.problem, {}).usable());
    after += rms_centre_error(circle.problem.S_world, circle.truth);
    for (const Sim3& S : circle.problem.S_world) ASSERT_EQ(S.scale(), 1.0);
  }
  EXPECT_GT(before / 10, 0.3);  // metres, the initial error
  EXPECT_LT(after, 0.5 * before);
}

TEST(PoseGraph, ClosesALoopWithScaleDrift) {
  Random random(3);
  for (int trial = 0; trial < 10; ++trial) {
    // 0.4 % per step: the scale of the last of 120 keyframes is wrong by more than a third.
    Circle circle = make_circle(120, 2, true, kScaleFree, 0.1, random, -0.004);
    const double before = rms_centre_error(circle.problem.S_world, circle.truth);
    EXPECT_GT(std::abs(std::log(circle.problem.S_world.back().scale())), 0.3);
    ASSERT_TRUE(optimise(circle.problem, {}).usable());
    EXPECT_GT(before, 1.5);
    EXPECT_LT(rms_centre_error(circle.problem.S_world, circle.truth), 0.25 * before);
    EXPECT_NEAR(circle.problem.S_world.back().scale(), 1.0, 0.05);
  }
}

// At the minimum twice the cost follows a chi-square with residuals less unknowns degrees of freedom.
TEST(PoseGraph, FinalCostMatchesTheNoise) {
  for (const bool free_scale : {kRigid, kScaleFree}) {
    Random random(4);
    double sum = 0.0, dof = 0.0;
    for (int trial = 0; trial < 5; ++trial) {
      Circle circle = make_circle(100, 4, true, free_scale, 1.0, random);
      const LmSummary summary = optimise(circle.problem, {});
      sum += 2 * summary.final_cost;
      dof += (free_scale ? 7.0 : 6.0) * static_cast<double>(circle.problem.edges.size() - circle.truth.size() + 1);
    }
    EXPECT_NEAR(sum / dof, 1.0, 4 * std::sqrt(2 / dof) + 0.01);
  }
}

TEST(PoseGraph, FollowsTheHeavierEdge) {
  PoseGraphProblem problem;
  problem.S_world.resize(2);
  problem.fixed = {1, 0};
  const auto at = [](double x) { return Sim3(1.0, Quaterniond::Identity(), Vector3d(x, 0, 0)); };
  problem.edges = {{1, 0, at(1.0), 1.0}, {1, 0, at(2.0), 3.0}};
  ASSERT_TRUE(optimise(problem, {}).usable());
  EXPECT_NEAR(problem.S_world[1].translation().x(), 1.75, 1e-9);
}

TEST(PoseGraph, FixesTheFirstVertexOfAComponentWithoutFixedVertex) {
  Random random(5);
  Circle one = make_circle(20, 2, true, kRigid, 1.0, random);
  PoseGraphProblem problem = one.problem;  // 0 to 19, of which 0 is fixed
  const Circle other = make_circle(20, 2, true, kRigid, 1.0, random);
  const Sim3 away(1.0, Quaterniond(Eigen::AngleAxisd(0.5, Vector3d::UnitX())), Vector3d(1, 2, 3));
  for (const Sim3& S : other.problem.S_world) problem.S_world.push_back(S * away);
  for (PoseGraphProblem::Edge edge : other.problem.edges) {
    edge.a += 20;
    edge.b += 20;
    problem.edges.push_back(edge);
  }
  problem.S_world.push_back(away);  // 40: alone
  problem.fixed.resize(41, 0);
  const std::vector<Sim3> before = problem.S_world;
  ASSERT_EQ(optimise(problem, {}).stop, LmStop::kConverged);
  for (const std::size_t i : {0u, 20u, 40u}) expect_equal(problem.S_world[i], before[i]);
  ASSERT_TRUE(optimise(one.problem, {}).usable());
  for (std::size_t i = 0; i < 20; ++i) {  // the components are independent
    EXPECT_LT((problem.S_world[i] * one.problem.S_world[i].inverse()).log().norm(), 1e-6);
    EXPECT_GT((problem.S_world[20 + i] * before[20 + i].inverse()).log().norm(), i == 0 ? -1.0 : 1e-4);
  }
}

TEST(PoseGraph, DoesNotChangeFixedVertices) {
  Random random(6);
  Circle circle = make_circle(40, 2, true, kScaleFree, 1.0, random);
  for (std::size_t i = 0; i < 40; i += 7) circle.problem.fixed[i] = 1;
  const std::vector<Sim3> before = circle.problem.S_world;
  ASSERT_TRUE(optimise(circle.problem, {}).usable());
  for (std::size_t i = 0; i < 40; i += 7) expect_equal(circle.problem.S_world[i], before[i]);
}

TEST(PoseGraph, DoesNothingWithoutEdgesOrFreeVertices) {
  PoseGraphProblem empty;
  EXPECT_TRUE(optimise(empty, {}).usable());
  Random random(7);
  Circle circle = make_circle(10, 2, false, kRigid, 1.0, random);
  circle.problem.fixed.assign(10, 1);
  const LmSummary summary = optimise(circle.problem, {});
  EXPECT_EQ(summary.stop, LmStop::kConverged);
  EXPECT_GT(summary.initial_cost, 0.0);
  EXPECT_EQ(summary.final_cost, summary.initial_cost);
}

TEST(PoseGraph, FailureDoesNotChangeTheProblem) {
  Random random(8);
  Circle circle = make_circle(10, 2, true, kRigid, 1.0, random);
  circle.problem.edges[3].S_a_b = Sim3(1.0, Quaterniond::Identity(), Vector3d(0, std::nan(""), 0));
  const std::vector<Sim3> before = circle.problem.S_world;
  EXPECT_EQ(optimise(circle.problem, {}).stop, LmStop::kFailed);
  for (std::size_t i = 0; i < before.size(); ++i) expect_equal(circle.problem.S_world[i], before[i]);
}

TEST(PoseGraph, StopsOnAStopRequest) {
  Random random(9);
  Circle circle = make_circle(30, 2, true, kRigid, 1.0, random);
  std::stop_source source;
  source.request_stop();
  const LmSummary summary = optimise(circle.problem, {}, source.get_token());
  EXPECT_EQ(summary.stop, LmStop::kStopped);
  EXPECT_EQ(summary.final_cost, summary.initial_cost);
}

TEST(PoseGraph, IsDeterministic) {
  for (const bool free_scale : {kRigid, kScaleFree}) {
    Random random(10);
    Circle circle = make_circle(80, 3, true, free_scale, 1.0, random);
    PoseGraphProblem again = circle.problem;
    EXPECT_EQ(optimise(circle.problem, {}).final_cost, optimise(again, {}).final_cost);
    for (std::size_t i = 0; i < 80; ++i) expect_equal(circle.problem.S_world[i], again.S_world[i]);
  }
}

// The same cost in Ceres with automatic derivatives and different parameters: angle-axis, translation, log scale.
struct CeresEdge {
  Sim3 S_b_a;
  Vector7d weights;

  template <class T>
  bool operator()(const T* a, const T* b, T* error) const {
    const Quaterniond q = S_b_a.rotation();
    const T q_m[4] = {T(q.w()), T(q.x()), T(q.y()), T(q.z())}, b_inverse[3] = {-b[0], -b[1], -b[2]};
    T q_a[4], q_b[4], q_ab[4], q_e[4], t_b[3], t_ab[3], t_e[3];
    ceres::AngleAxisToQuaternion(a, q_a);
    ceres::AngleAxisToQuaternion(b_inverse, q_b);
    ceres::QuaternionProduct(q_a, q_b, q_ab);
    ceres::QuaternionProduct(q_m, q_ab, q_e);
    ceres::QuaternionToAngleAxis(q_e, error);
    const T scale = exp(a[6] - b[6]);  // of S_a S_b^-1
    ceres::QuaternionRotatePoint(q_ab, b + 3, t_b);
    for (int k = 0; k < 3; ++k) t_ab[k] = a[3 + k] - scale * t_b[k];
    ceres::QuaternionRotatePoint(q_m, t_ab, t_e);
    for (int k = 0; k < 3; ++k) error[3 + k] = S_b_a.scale() * t_e[k] + S_b_a.translation()(k);
    error[6] = a[6] - b[6] + std::log(S_b_a.scale());
    for (int k = 0; k < 7; ++k) error[k] *= weights(k);
    return true;
  }
};

// Its derivatives by dual numbers.
class CeresCost : public ceres::SizedCostFunction<7, 7, 7> {
 public:
  explicit CeresCost(const CeresEdge& edge) : edge_(edge) {}

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    using Jet = ceres::Jet<double, 14>;
    std::array<Jet, 7> a, b, error;
    for (int k = 0; k < 7; ++k) {
      a[static_cast<std::size_t>(k)] = Jet(parameters[0][k], k);
      b[static_cast<std::size_t>(k)] = Jet(parameters[1][k], 7 + k);
    }
    edge_(a.data(), b.data(), error.data());
    for (int row = 0; row < 7; ++row) {
      const Jet& e = error[static_cast<std::size_t>(row)];
      residuals[row] = e.a;
      for (int block = 0; jacobians != nullptr && block < 2; ++block) {
        for (int k = 0; jacobians[block] != nullptr && k < 7; ++k) jacobians[block][7 * row + k] = e.v(7 * block + k);
      }
    }
    return true;
  }

 private:
  CeresEdge edge_;
};

double solve_by_ceres(PoseGraphProblem& problem, const PoseGraphOptions& options) {
  std::vector<Vector7d> parameters;
  for (const Sim3& S : problem.S_world) {
    Vector7d x;
    x << geometry::so3_log(S.rotation()), S.translation(), std::log(S.scale());
    parameters.push_back(x);
  }
  Vector7d weights = Vector7d::Constant(1 / options.sigma_rotation);
  weights.segment<3>(3).setConstant(1 / options.sigma_translation);
  weights(6) = 1 / options.sigma_log_scale;
  ceres::Problem ceres_problem;
  for (const auto& edge : problem.edges) {
    ceres_problem.AddResidualBlock(new CeresCost({edge.S_a_b.inverse(), std::sqrt(edge.weight) * weights}), nullptr,
                                   parameters[static_cast<std::size_t>(edge.a)].data(),
                                   parameters[static_cast<std::size_t>(edge.b)].data());
  }
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    if (!problem.free_scale) {
      ceres_problem.SetManifold(parameters[i].data(), new ceres::SubsetManifold(7, std::vector<int>{6}));
    }
    if (problem.fixed[i] != 0) ceres_problem.SetParameterBlockConstant(parameters[i].data());
  }
  ceres::Solver::Options solver;
  solver.linear_solver_type = ceres::DENSE_NORMAL_CHOLESKY;
  solver.max_num_iterations = 200;
  solver.function_tolerance = solver.gradient_tolerance = solver.parameter_tolerance = 1e-15;
  solver.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(solver, &ceres_problem, &summary);
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const Vector7d& x = parameters[i];
    problem.S_world[i] = Sim3(std::exp(x(6)), geometry::so3_exp(x.head<3>()), x.segment<3>(3));
  }
  return summary.final_cost;
}

TEST(PoseGraph, ReachesTheSameMinimumAsCeres) {
  for (const bool free_scale : {kRigid, kScaleFree}) {
    Random random(11);
    Circle circle = make_circle(40, 3, true, free_scale, 2.0, random, free_scale ? 0.01 : 0.0);
    for (auto& edge : circle.problem.edges) edge.weight = random.uniform(0.2, 3.0);
    PoseGraphProblem reference = circle.problem;
    PoseGraphOptions options;
    options.relative_decrease = 0.0;
    options.iterations = 50;
    const LmSummary summary = optimise(circle.problem, options);
    EXPECT_EQ(summary.stop, LmStop::kConverged);
    const double cost = solve_by_ceres(reference, options);
    EXPECT_NEAR(summary.final_cost, cost, 1e-8 * cost);
    for (std::size_t i = 0; i < circle.truth.size(); ++i) {
      EXPECT_LT((circle.problem.S_world[i] * reference.S_world[i].inverse()).log().norm(), 1e-5) << i;
    }
  }
}

// Gauss-Newton with exact Jacobians converges quadratically; with a wrong Jacobian it would need many steps.
TEST(PoseGraph, NeedsFewStepsFromAPoorInitialGraph) {
  for (const bool free_scale : {kRigid, kScaleFree}) {
    Random random(12);
    Circle circle = make_circle(100, 3, true, free_scale, 1.0, random);
    for (std::size_t i = 1; i < 100; ++i) {
      Vector7d off;
      off << solver::scene::random_twist(random, 0.2, 0.5), free_scale ? random.uniform(-0.2, 0.2) : 0.0;
      circle.problem.S_world[i] = circle.problem.S_world[i].perturbed(off);
    }
    PoseGraphOptions options;
    options.relative_decrease = 1e-9;
    const LmSummary summary = optimise(circle.problem, options);
    EXPECT_EQ(summary.stop, LmStop::kConverged);
    EXPECT_LE(summary.iterations, 8);
  }
}

}  // namespace
}  // namespace bslam::looping
