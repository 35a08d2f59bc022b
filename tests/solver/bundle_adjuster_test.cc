#include "solver/bundle_adjuster.h"

#include <gtest/gtest.h>

#include "solver/ceres_reference.h"
#include "solver/scene.h"

namespace bslam::solver {
namespace {

using scene::BundleSpec;
using scene::Models;

BundleOptions to_the_end(bool robust) {
  BundleOptions options;
  options.iterations = 200;
  options.relative_decrease = 1e-13;
  options.robust = robust;
  return options;
}

double largest_difference(const ReprojectionProblem& a, const ReprojectionProblem& b) {
  double largest = 0.0;
  for (std::size_t i = 0; i < a.T_rig_world.size(); ++i) {
    largest = std::max(largest, (a.T_rig_world[i].matrix() - b.T_rig_world[i].matrix()).norm());
  }
  return largest;
}

struct CeresCase {
  std::size_t cameras;
  Models models;
  bool robust;
  double outlier_ratio;
};
class AgainstCeres : public testing::TestWithParam<CeresCase> {};

TEST_P(AgainstCeres, ReachesTheSameMinimum) {
  const CeresCase c = GetParam();
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    Random random(seed, "ceres");
    BundleSpec spec;
    spec.cameras = c.cameras;
    spec.models = c.models;
    spec.outlier_ratio = c.outlier_ratio;
    spec.farthest = 10;  // farther points may have their minimum at infinity
    const auto scene = scene::make_bundle_scene(spec, random);
    ReprojectionProblem ours = scene->problem, theirs = scene->problem;
    const LmSummary summary = adjust(ours, to_the_end(c.robust));
    const double reference = ceres_reference::adjust(theirs, c.robust);
    ASSERT_TRUE(summary.usable());
    EXPECT_NEAR(summary.final_cost, reference, 1e-6 * reference) << "seed " << seed;
    EXPECT_LT(largest_difference(ours, theirs), 1e-4) << "seed " << seed;
    EXPECT_LT(summary.final_cost, 0.5 * summary.initial_cost);
  }
}

INSTANTIATE_TEST_SUITE_P(
    Rigs, AgainstCeres,
    testing::Values(CeresCase{1, Models::kPinhole, false, 0.0}, CeresCase{2, Models::kRadTan, false, 0.0},
                    CeresCase{2, Models::kRadTan, true, 0.1}, CeresCase{3, Models::kFisheye, true, 0.0},
                    CeresCase{4, Models::kMixed, false, 0.0}, CeresCase{4, Models::kMixed, true, 0.1}));

TEST(BundleAdjuster, RecoversTruthWithoutNoise) {
  Random random(1);
  BundleSpec spec;
  spec.noise = 0.0;
  const auto scene = scene::make_bundle_scene(spec, random);
  const LmSummary summary = adjust(scene->problem, to_the_end(true));
  // Pixels are stored as float: 1e-5 px.
  EXPECT_LT(summary.final_cost, 1e-4);
  for (std::size_t i = 0; i < scene->T_rig_world.size(); ++i) {
    EXPECT_LT(scene::centre_error(scene->problem.T_rig_world[i], scene->T_rig_world[i]), 1e-4);
    EXPECT_LT(scene::rotation_error(scene->problem.T_rig_world[i], scene->T_rig_world[i]), 1e-5);
  }
}

TEST(BundleAdjuster, NearlyConvergesInFiveIterations) {
  Random random(2);
  const auto scene = scene::make_bundle_scene(BundleSpec{}, random);
  ReprojectionProblem best = scene->problem;
  const double minimum = adjust(best, to_the_end(true)).final_cost;
  BundleOptions five;
  five.iterations = 5;
  EXPECT_LT(adjust(scene->problem, five).final_cost, 1.01 * minimum);
}

TEST(BundleAdjuster, DoesNotChangeFixedPoses) {
  Random random(3);
  BundleSpec spec;
  spec.fixed_poses = 3;
  const auto scene = scene::make_bundle_scene(spec, random);
  scene->problem.pose_free = {1, 1, 0, 1, 0, 1, 1, 0, 1};
  const auto before = scene->problem.T_rig_world;
  EXPECT_TRUE(adjust(scene->problem, {}).usable());
  for (std::size_t i = 0; i < before.size(); ++i) {
    EXPECT_EQ(before[i].matrix() == scene->problem.T_rig_world[i].matrix(), scene->problem.pose_free[i] == 0) << i;
  }
}

TEST(BundleAdjuster, MovesOnlyPointsIfAllPosesAreFixed) {
  Random random(4);
  BundleSpec spec;
  spec.free_poses = 0;
  spec.fixed_poses = 6;
  spec.noise = 0.0;
  const auto scene = scene::make_bundle_scene(spec, random);
  EXPECT_LT(adjust(scene->problem, to_the_end(false)).final_cost, 1e-4);
}

TEST(BundleAdjuster, StopsOnRequest) {
  Random random(5);
  const auto scene = scene::make_bundle_scene(BundleSpec{}, random);
  const ReprojectionProblem before = scene->problem;
  std::stop_source stop;
  stop.request_stop();
  const LmSummary summary = adjust(scene->problem, {}, {}, stop.get_token());
  EXPECT_EQ(summary.stop, LmStop::kStopped);
  EXPECT_EQ(summary.iterations, 0);
  EXPECT_EQ(largest_difference(before, scene->problem), 0.0);
}

TEST(BundleAdjuster, IsDeterministic) {
  for (const int dense_poses : {150, 0}) {
    Random random(6);
    const auto scene = scene::make_bundle_scene(BundleSpec{}, random);
    ReprojectionProblem a = scene->problem, b = scene->problem;
    BundleOptions options;
    options.dense_poses = dense_poses;
    EXPECT_EQ(adjust(a, options).final_cost, adjust(b, options).final_cost);
    EXPECT_EQ(largest_difference(a, b), 0.0);
    EXPECT_EQ(a.points, b.points);
  }
}

TEST(BundleAdjuster, SparseAndDenseSolutionsAgree) {
  Random random(7);
  BundleSpec spec;
  spec.free_poses = 40;
  spec.points = 600;
  const auto scene = scene::make_bundle_scene(spec, random);
  ReprojectionProblem dense = scene->problem, sparse = scene->problem;
  BundleOptions options;
  const LmSummary a = adjust(dense, options);
  options.dense_poses = 0;
  const LmSummary b = adjust(sparse, options);
  EXPECT_EQ(a.iterations, b.iterations);
  EXPECT_NEAR(a.final_cost, b.final_cost, 1e-9 * a.final_cost);
  EXPECT_LT(largest_difference(dense, sparse), 1e-8);
}

// The normalised errors of all observations after a change of the free poses (six each), then of the points.
Eigen::VectorXd errors_after(const ReprojectionProblem& problem, const Eigen::VectorXd& change) {
  std::vector<SE3> poses = problem.T_rig_world;
  Eigen::Index at = 0;
  for (std::size_t k = 0; k < poses.size(); ++k) {
    if (!problem.pose_free[k]) continue;
    poses[k] = poses[k].perturbed(change.segment<6>(at));
    at += 6;
  }
  Eigen::VectorXd out(2 * static_cast<Eigen::Index>(problem.observations.size()));
  for (std::size_t i = 0; i < problem.observations.size(); ++i) {
    const auto& o = problem.observations[i];
    const Vector3d point =
        problem.points[static_cast<std::size_t>(o.point)] + change.segment<3>(at + 3 * Eigen::Index{o.point});
    const Vector3d point_cam =
        problem.rig->cam_from_rig(o.camera.index()) * (poses[static_cast<std::size_t>(o.pose)] * point);
    const auto pixel = problem.rig->camera(o.camera.index()).project(point_cam);
    out.segment<2>(2 * static_cast<Eigen::Index>(i)) =
        (o.pixel.cast<double>() - pixel.value_or(Vector2d::Zero())) / static_cast<double>(o.sigma);
  }
  return out;
}

TEST(BundleAdjuster, CovariancesAreBlocksOfTheInverseOfTheDenseInformation) {
  Random random(8);
  BundleSpec spec;
  spec.points = 60;
  spec.free_poses = 4;
  spec.farthest = 8;
  spec.point_distance = 0.01;
  const auto scene = scene::make_bundle_scene(spec, random);
  ReprojectionProblem& problem = scene->problem;
  for (std::size_t i = 0; i < problem.observations.size(); i += 3) problem.observations[i].sigma = 2.0f;
  const Eigen::Index size = 6 * spec.free_poses + 3 * spec.points;
  constexpr double kStep = 1e-6;
  Eigen::MatrixXd J(2 * static_cast<Eigen::Index>(problem.observations.size()), size);
  for (Eigen::Index k = 0; k < size; ++k) {
    const Eigen::VectorXd step = kStep * Eigen::VectorXd::Unit(size, k);
    J.col(k) = (errors_after(problem, step) - errors_after(problem, -step)) / (2 * kStep);
  }
  const Eigen::MatrixXd covariance = (J.transpose() * J).ldlt().solve(Eigen::MatrixXd::Identity(size, size));
  for (const int dense_poses : {150, 0}) {
    // No iteration: the covariances are those at the given values.
    const BundleSummary summary =
        adjust(problem, {.iterations = 0, .robust = false, .dense_poses = dense_poses, .marginals = {2, 3, 5, 0}});
    ASSERT_EQ(summary.uncertainties.size(), 4u);
    EXPECT_FALSE(summary.uncertainties[3]);  // fixed
    const Eigen::Index first[] = {0, 6, 18};
    for (int i = 0; i < 3; ++i) {
      ASSERT_TRUE(summary.uncertainties[static_cast<std::size_t>(i)]);
      const geometry::Matrix6d expected = covariance.block<6, 6>(first[i], first[i]);
      const geometry::Matrix6d& found = summary.uncertainties[static_cast<std::size_t>(i)]->noise;
      // Compared in units of the standard deviations, since angles and metres differ in magnitude.
      const geometry::Vector6d unit = expected.diagonal().cwiseSqrt().cwiseInverse();
      EXPECT_LT((unit.asDiagonal() * (found - expected) * unit.asDiagonal()).norm(), 1e-4);
    }
  }
}

// A calibration that differs by the error moves the adjusted poses by its effect.
TEST(BundleAdjuster, EffectOfTheCalibrationIsTheChangeOfTheAdjustedPoses) {
  Random random(9);
  BundleSpec spec;
  spec.cameras = 3;
  spec.models = Models::kMixed;
  spec.points = 200;
  spec.free_poses = 4;
  spec.noise = 0.0;
  const auto scene = scene::make_bundle_scene(spec, random);
  const RigValues rig = RigValues::of(*scene->problem.rig);
  Eigen::Index size = 6 * 2;
  for (const camera::CameraModel& model : rig.models) size += camera::parameters(model).size();
  Eigen::VectorXd error = Eigen::VectorXd::Zero(size);  // of the rotation of camera 2, the position of camera 1
  error.segment<3>(6) << 1e-5, -2e-5, 1e-5;
  error.segment<3>(3) << 1e-5, 1e-5, -1e-5;
  error(12) = 0.01;  // of fx of camera 0
  // of each pose by the same error: fixed poses may depend on the calibration, too
  std::vector<geometry::PoseUncertainty::Effect> of_fixed(scene->problem.T_rig_world.size(),
                                                          geometry::PoseUncertainty::Effect(6, 0));
  std::size_t fixed = 0;
  for (std::size_t i = 0; i < of_fixed.size(); ++i) {
    if (scene->problem.pose_free[i] != 0) continue;
    of_fixed[i] = 1e-5 * static_cast<double>(fixed++) * geometry::Vector6d(1, -2, 1, 3, 2, -2);
  }
  ASSERT_GE(fixed, 2u);
  const auto adjusted_with = [&](double sign, bool fixed_move) {
    RigValues values = rig;
    for (std::size_t c : {1, 2})
      values.T_cam_rig[c] =
          values.T_cam_rig[c].perturbed(sign * error.segment<6>(6 * (static_cast<Eigen::Index>(c) - 1)));
    camera::ModelParameters step = camera::ModelParameters::Zero(camera::parameters(values.models[0]).size());
    step(0) = sign * error(12);
    values.models[0] = camera::with_parameters(values.models[0], camera::parameters(values.models[0]) + step);
    const Rig changed = values.applied_to(*scene->problem.rig);
    ReprojectionProblem problem = scene->problem;
    problem.rig = &changed;
    for (std::size_t i = 0; fixed_move && i < of_fixed.size(); ++i) {
      if (of_fixed[i].cols() > 0) problem.T_rig_world[i] = problem.T_rig_world[i].perturbed(sign * of_fixed[i]);
    }
    EXPECT_TRUE(adjust(problem, to_the_end(false)).usable());
    return problem.T_rig_world;
  };
  for (const auto& [dense_poses, fixed_move] : {std::pair{150, false}, {0, false}, {150, true}, {0, true}}) {
    const std::vector<SE3> plus = adjusted_with(1, fixed_move), minus = adjusted_with(-1, fixed_move);
    ReprojectionProblem problem = scene->problem;
    BundleOptions options = to_the_end(false);
    options.dense_poses = dense_poses;
    options.marginals = {2, 3, 4};
    options.rig_deviation = std::make_shared<const Eigen::MatrixXd>(error);
    if (fixed_move) options.fixed_effects = of_fixed;
    const BundleSummary summary = adjust(problem, options);
    for (std::size_t k = 0; k < options.marginals.size(); ++k) {
      const auto pose = static_cast<std::size_t>(options.marginals[k]);
      ASSERT_TRUE(problem.pose_free[pose]);
      ASSERT_TRUE(summary.uncertainties[k]);
      const geometry::Vector6d change = 0.5 * (plus[pose] * minus[pose].inverse()).log();
      EXPECT_GT(change.norm(), 1e-6);
      EXPECT_LT((summary.uncertainties[k]->calibration - change).norm(), 1e-3 * change.norm());
    }
  }
}

TEST(BundleAdjuster, IgnoresSkippedObservations) {
  Random random(8);
  BundleSpec spec;
  spec.noise = 0.0;
  const auto scene = scene::make_bundle_scene(spec, random);
  std::vector<std::uint8_t> skip(scene->problem.observations.size(), 0);
  for (std::size_t i = 0; i < skip.size(); i += 7) {
    scene->problem.observations[i].pixel.array() += 50.0f;
    skip[i] = 1;
  }
  EXPECT_LT(adjust(scene->problem, to_the_end(false), skip).final_cost, 1e-4);
}

TEST(BundleAdjuster, CostNeverIncreases) {
  Random random(9);
  BundleSpec spec;
  spec.outlier_ratio = 0.2;
  spec.pose_angle = 0.1;
  spec.pose_distance = 0.5;
  spec.point_distance = 1.0;
  const auto scene = scene::make_bundle_scene(spec, random);
  double last = std::numeric_limits<double>::infinity();
  for (int iterations = 0; iterations <= 30; ++iterations) {
    ReprojectionProblem problem = scene->problem;
    BundleOptions options;
    options.iterations = iterations;
    const LmSummary summary = adjust(problem, options);
    EXPECT_LE(summary.final_cost, last) << iterations;
    last = summary.final_cost;
  }
}

TEST(BundleAdjuster, FinalCostMatchesTheSquaredErrors) {
  Random random(10);
  const auto scene = scene::make_bundle_scene(BundleSpec{}, random);
  const LmSummary summary = adjust(scene->problem, {});
  double sum = 0.0;
  std::vector<int> count(scene->problem.points.size(), 0);
  for (const auto& o : scene->problem.observations) ++count[static_cast<std::size_t>(o.point)];
  const std::vector<double> chi2 = squared_errors(scene->problem);
  for (std::size_t i = 0; i < chi2.size(); ++i) {
    if (count[static_cast<std::size_t>(scene->problem.observations[i].point)] >= 2) sum += 0.5 * huber_cost(chi2[i]);
  }
  EXPECT_NEAR(sum, summary.final_cost, 1e-9 * sum);
}

TEST(BundleAdjuster, ToleratesPointsOfOneRayAndPointsBehindACamera) {
  Random random(11);
  BundleSpec spec;
  spec.cameras = 1;
  spec.models = Models::kPinhole;
  const auto scene = scene::make_bundle_scene(spec, random);
  ReprojectionProblem problem = scene->problem;
  auto& observations = problem.observations;
  // Points 0 to 9 keep one observation; 10 to 19 are initially behind the cameras; 20 to 29 are very close to a camera.
  std::vector<std::uint8_t> seen(problem.points.size(), 0);
  std::erase_if(observations,
                [&](const auto& o) { return o.point < 10 && seen[static_cast<std::size_t>(o.point)]++ > 0; });
  for (std::size_t p = 10; p < 20; ++p) problem.points[p] = scene->T_rig_world[0].inverse() * Vector3d(0, 0, -5);
  for (std::size_t p = 20; p < 30; ++p)
    problem.points[p] = scene->T_rig_world[7].inverse() * Vector3d(0.01, 0.01, 0.02);
  const auto before = problem.points;
  const LmSummary summary = adjust(problem, to_the_end(true));
  EXPECT_TRUE(summary.usable());
  for (std::size_t p = 0; p < 20; ++p) EXPECT_EQ(problem.points[p], before[p]) << p;
  for (std::size_t i = 0; i < scene->T_rig_world.size(); ++i) {
    EXPECT_TRUE(problem.T_rig_world[i].translation().allFinite());
    EXPECT_LT(scene::centre_error(problem.T_rig_world[i], scene->T_rig_world[i]), 0.1) << i;
  }
}

TEST(BundleAdjuster, FailsWithoutObservations) {
  const Rig rig = scene::make_rig(1, Models::kPinhole);
  ReprojectionProblem problem;
  problem.rig = &rig;
  problem.T_rig_world = {SE3(), SE3()};
  problem.pose_free = {0, 1};
  EXPECT_EQ(adjust(problem, {}).stop, LmStop::kFailed);
}

TEST(BundleAdjusterDeathTest, RejectsAProblemWithoutAFixedPose) {
  Random random(12);
  const auto scene = scene::make_bundle_scene(BundleSpec{}, random);
  scene->problem.pose_free.assign(scene->problem.pose_free.size(), 1);
  EXPECT_DEATH(adjust(scene->problem, {}), "fixed");
}

TEST(BundleAdjusterDeathTest, RejectsAProblemWhoseSizesDoNotFit) {
  Random random(13);
  const auto scene = scene::make_bundle_scene(BundleSpec{}, random);
  const ReprojectionProblem& good = scene->problem;
  const auto with = [&](const auto& change) {
    ReprojectionProblem problem = good;
    change(problem);
    return problem;
  };
  const auto dies = [](ReprojectionProblem problem, const char* message) {
    EXPECT_DEATH(adjust(problem, {}), message);
    EXPECT_DEATH(static_cast<void>(squared_errors(problem)), message);
  };
  dies(with([](ReprojectionProblem& p) { p.rig = nullptr; }), "must have a rig");
  dies(with([](ReprojectionProblem& p) { p.twist.resize(p.T_rig_world.size() - 1); }), "twist");
  dies(with([](ReprojectionProblem& p) { p.motion.resize(1); }), "motion");
  dies(with([](ReprojectionProblem& p) { p.pose_free.pop_back(); }), "pose_free");
  dies(with([](ReprojectionProblem& p) { p.points.pop_back(); }), "a pose and a point");
  ReprojectionProblem problem = good;
  BundleOptions options;
  options.fixed_effects.resize(problem.T_rig_world.size() + 1);
  EXPECT_DEATH(adjust(problem, options), "fixed_effects");
  EXPECT_DEATH(static_cast<void>(squared_errors(problem, problem.T_rig_world, {}, RigValues::of(*problem.rig))),
               "one pose and one point");
}

TEST(SquaredErrors, AreNormalisedAndInfiniteBehindTheCamera) {
  const Rig rig = scene::make_rig(1, Models::kPinhole);
  ReprojectionProblem problem;
  problem.rig = &rig;
  problem.T_rig_world = {SE3()};
  problem.pose_free = {0};
  problem.points = {Vector3d(0, 0, 2), Vector3d(0, 0, -2)};
  const Vector2d centre = *rig.camera(0).project(Vector3d(0, 0, 2));
  problem.observations = {{0, 0, CameraIndex(0), (centre + Vector2d(3, 4)).cast<float>(), 2.0f},
                          {0, 1, CameraIndex(0), centre.cast<float>(), 1.0f}};
  const auto chi2 = squared_errors(problem);
  ASSERT_EQ(chi2.size(), 2u);
  EXPECT_NEAR(chi2[0], 25.0 / 4.0, 1e-9);
  EXPECT_TRUE(std::isinf(chi2[1]));
}

}  // namespace
}  // namespace bslam::solver
