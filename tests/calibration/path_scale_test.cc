#include "calibration/path_scale.h"

#include <gtest/gtest.h>

#include "base/random.h"

namespace bslam::calibration {
namespace {

using Effect = geometry::PoseUncertainty::Effect;

geometry::Vector6d random_vector(Random& random) {
  geometry::Vector6d out;
  for (int k = 0; k < 6; ++k) out(k) = random.normal();
  return out;
}

TEST(PathDeviation, IsTheDerivativeOfThePathLengthByTheErrorOfTheCalibration) {
  constexpr int kErrors = 3;
  Random random(1);
  RigProblem problem;
  problem.group = {0, 0, 0, 1, 1, 1};
  auto& poses = problem.selected.problem.T_rig_world;
  std::vector<Effect> effects;
  for (std::size_t i = 0; i < problem.group.size(); ++i) {
    poses.push_back(geometry::SE3::exp(random_vector(random)));
    effects.push_back(Effect::Zero(6, kErrors));
    for (int k = 0; k < kErrors && i != 3; ++k) effects.back().col(k) = random_vector(random);  // pose 3 is fixed
  }
  constexpr double kStep = 1e-6;
  double squares = 0;
  for (int k = 0; k < kErrors; ++k) {
    RigProblem plus = problem, minus = problem;
    for (std::size_t i = 0; i < poses.size(); ++i) {
      plus.selected.problem.T_rig_world[i] = poses[i].perturbed(kStep * effects[i].col(k));
      minus.selected.problem.T_rig_world[i] = poses[i].perturbed(-kStep * effects[i].col(k));
    }
    const double derivative = (path_length(plus) - path_length(minus)) / (2 * kStep);
    squares += derivative * derivative;
  }
  EXPECT_GT(squares, 1);
  EXPECT_NEAR(path_deviation(problem, effects), std::sqrt(squares), 1e-6);
}

}  // namespace
}  // namespace bslam::calibration
