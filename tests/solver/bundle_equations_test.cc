// Compares the normal equations of bundle adjustment with differences of their cost, for poses, points and all blocks
// of the rig.
#include "solver/bundle_equations.h"

#include <gtest/gtest.h>

#include <tuple>

#include "solver/ceres_reference.h"
#include "solver/lm.h"
#include "solver/scene.h"

namespace bslam::solver {
namespace {

using geometry::Vector6d;
using scene::BundleSpec;
using scene::Models;

ExtrinsicPrior prior_of(const Rig& rig) {
  ExtrinsicPrior prior{.T_cam_rig = {}, .sigma_rotation = 0.02, .sigma_translation = 0.03, .sigma_depth = 0.04};
  for (std::size_t c = 0; c < rig.size(); ++c) prior.T_cam_rig.push_back(rig.cam_from_rig(c));
  return prior;
}

enum class BlockType { kExtrinsics, kBaselineScale, kTiming, kSharedTiming };

RigBlocks make_blocks(BlockType type, const Rig& rig) {
  RigBlocks blocks;
  if (type == BlockType::kExtrinsics) {
    blocks.push_back(std::make_unique<ExtrinsicsBlock>(prior_of(rig)));
  } else if (type == BlockType::kSharedTiming) {
    SharedUnknowns shared(rig.size());
    for (std::size_t c = 0; c < rig.size(); ++c) shared[c] = c;
    shared.back() = 1;  // the last camera has the timing of camera 1
    blocks.push_back(
        std::make_unique<TimingBlock>(std::vector<TimingPrior>(rig.size(), {{0, 0.02}, 0.004, 0.003}), shared));
  } else if (type == BlockType::kTiming) {
    std::vector<TimingPrior> prior(rig.size(), {{0.001, 0.02}, 0.004, 0.003});
    prior[0].sigma_shift = prior[1].sigma_readout = 0;  // constant
    blocks.push_back(std::make_unique<TimingBlock>(prior));
  } else {
    blocks.push_back(std::make_unique<BaselineScaleBlock>());
  }
  return blocks;
}

// A scene with inaccurate initial values and motion between the times of pose and image.
std::unique_ptr<scene::BundleScene> moving_scene(Models models, double noise, Random& random) {
  BundleSpec spec;
  spec.models = models;
  spec.noise = noise;
  spec.points = 60;
  spec.farthest = 10;
  auto out = scene::make_bundle_scene(spec, random);
  for (std::size_t k = 0; k < out->problem.T_rig_world.size() * out->rig.size(); ++k) {
    out->problem.motion.push_back(SE3::exp(scene::random_twist(random, 0.01, 0.02)));
  }
  return out;
}

class BundleGradient : public testing::TestWithParam<std::tuple<Models, BlockType>> {};

// b is minus the gradient of the cost.
TEST_P(BundleGradient, AgreesWithFiniteDifferences) {
  Random random(1, "gradient");
  const auto scene = moving_scene(std::get<Models>(GetParam()), 1.0, random);
  const BundleStructure structure = make_structure(scene->problem, squared_errors(scene->problem), {});
  const RigBlocks blocks = make_blocks(std::get<BlockType>(GetParam()), scene->rig);
  BundleState start = state_of(scene->problem);
  if (std::get<BlockType>(GetParam()) != BlockType::kBaselineScale) {  // with rolling shutters of a moving rig
    for (std::size_t k = 0; k < scene->problem.T_rig_world.size(); ++k)
      scene->problem.twist.push_back(scene::random_twist(random, 0.9, 1.2));
    for (std::size_t c = 0; c < scene->rig.size(); ++c) start.rig.timing[c] = {0.001 * static_cast<double>(c), 0.018};
    if (std::get<BlockType>(GetParam()) == BlockType::kSharedTiming) start.rig.timing.back() = start.rig.timing[1];
  }
  for (std::size_t c = 1; c < scene->rig.size(); ++c) {
    start.rig.T_cam_rig[c] = start.rig.T_cam_rig[c].perturbed(scene::random_twist(random, 0.02, 0.02));
  }
  BundleEquations equations(scene->problem, structure, blocks, Kernel::kNone, 150, start);
  const auto cost_at = [&](const BundleState& state) {
    equations.state() = state;
    return equations.linearise();
  };
  cost_at(start);
  const auto poses = equations.pose_blocks();
  const auto points = equations.point_blocks();
  const Eigen::VectorXd rig = equations.rig_terms().b();
  constexpr double kStep = 1e-6;
  const auto slope = [&](const auto& move) {
    BundleState up = start, down = start;
    move(up, kStep);
    move(down, -kStep);
    return (cost_at(up) - cost_at(down)) / (2 * kStep);
  };
  for (std::size_t slot = 0; slot < poses.size(); ++slot) {
    const auto pose = static_cast<std::size_t>(structure.pose_of_slot[slot]);
    for (int k = 0; k < 6; ++k) {
      const double gradient = slope([&](BundleState& s, double step) {
        s.T_rig_world[pose] = s.T_rig_world[pose].perturbed(step * Vector6d::Unit(k));
      });
      EXPECT_NEAR(poses[slot].b(k), -gradient, 1e-5 * poses[slot].b.norm()) << "pose " << pose << ", " << k;
    }
  }
  for (std::size_t i = 0; i < points.size(); i += 7) {
    const auto point = static_cast<std::size_t>(structure.points[i].point);
    for (int k = 0; k < 3; ++k) {
      const double gradient = slope([&](BundleState& s, double step) { s.points[point](k) += step; });
      EXPECT_NEAR(points[i].b(k), -gradient, 1e-4 * points[i].b.norm() + 1e-3) << "point " << point << ", " << k;
    }
  }
  for (int k = 0; k < rig.size(); ++k) {
    const double gradient = slope([&](BundleState& s, double step) {
      equations.rig_terms().apply(step * Eigen::VectorXd::Unit(rig.size(), k), s.rig);
    });
    // The velocity of a point is exact to second order of the motion between rows.
    const BlockType type = std::get<BlockType>(GetParam());
    const double relative = type == BlockType::kTiming || type == BlockType::kSharedTiming ? 1e-4 : 1e-5;
    EXPECT_NEAR(rig(k), -gradient, relative * rig.norm() + 1e-3) << "rig " << k;
  }
}

INSTANTIATE_TEST_SUITE_P(EveryModelAndBlock, BundleGradient,
                         testing::Combine(testing::Values(Models::kPinhole, Models::kRadTan, Models::kFisheye,
                                                          Models::kMixed, Models::kSpheres),
                                          testing::Values(BlockType::kExtrinsics, BlockType::kBaselineScale,
                                                          BlockType::kTiming, BlockType::kSharedTiming)));

// Two cameras of the rig are the same one before and after a move.
TEST(BundleEquations, HaveTheGradientOfSharedIntrinsics) {
  Random random(8, "shared");
  const auto scene = moving_scene(Models::kRadTan, 1.0, random);
  const BundleStructure structure = make_structure(scene->problem, squared_errors(scene->problem), {});
  const std::size_t last = scene->rig.size() - 1;
  ASSERT_GE(last, 2u);
  BundleState start = state_of(scene->problem);
  start.rig.models[last] = start.rig.models[1];
  IntrinsicPrior prior{.values = {}, .sigmas = {}, .sigma_aspect = 0.001, .shared = {}};
  for (std::size_t c = 0; c <= last; ++c) {
    prior.values.push_back(camera::parameters(start.rig.models[c]));
    prior.sigmas.push_back(camera::typical_sigmas(start.rig.models[c], 0.01, 3));
    prior.shared.push_back(c == last ? 1 : c);
    prior.values.back()(0) += 2;
  }
  RigBlocks blocks;
  blocks.push_back(std::make_unique<IntrinsicsBlock>(prior));
  EXPECT_EQ(blocks[0]->size(), static_cast<int>(last) * static_cast<int>(prior.values[0].size()));
  BundleEquations equations(scene->problem, structure, blocks, Kernel::kNone, 150, start);
  const auto cost_at = [&](const Eigen::VectorXd& step) {
    equations.state() = start;
    equations.rig_terms().apply(step, equations.state().rig);
    return equations.linearise();
  };
  cost_at(Eigen::VectorXd::Zero(blocks[0]->size()));
  const Eigen::VectorXd b = equations.rig_terms().b();
  constexpr double kStep = 1e-5;
  for (int k = 0; k < b.size(); ++k) {
    const Eigen::VectorXd step = kStep * Eigen::VectorXd::Unit(b.size(), k);
    EXPECT_NEAR(b(k), -(cost_at(step) - cost_at(-step)) / (2 * kStep), 1e-5 * b.norm() + 1e-3) << k;
  }
}

// Without noise the residuals at the minimum are zero and Gauss-Newton converges quadratically, which it does
// only if all blocks, borders and couplings are correct.
TEST(BundleEquations, StepWithRigBlocksConvergesQuadratically) {
  for (const int dense_poses : {150, 0}) {
    Random random(2, "newton");
    BundleSpec spec;
    spec.noise = 0.0;
    spec.points = 100;
    spec.farthest = 10;
    const auto scene = scene::make_bundle_scene(spec, random);
    for (std::size_t k = 0; k < scene->T_rig_world.size(); ++k) {
      if (scene->problem.pose_free[k] == 0) continue;
      scene->problem.T_rig_world[k] = scene->T_rig_world[k].perturbed(scene::random_twist(random, 1e-3, 1e-3));
    }
    for (std::size_t p = 0; p < scene->points.size(); ++p) {
      scene->problem.points[p] = scene->points[p] + 1e-3 * scene::random_direction(random);
    }
    const BundleStructure structure = make_structure(scene->problem, squared_errors(scene->problem), {});
    RigBlocks blocks;
    blocks.push_back(std::make_unique<ExtrinsicsBlock>(prior_of(scene->rig)));
    BundleState start = state_of(scene->problem);
    for (std::size_t c = 1; c < scene->rig.size(); ++c) {
      start.rig.T_cam_rig[c] = start.rig.T_cam_rig[c].perturbed(scene::random_twist(random, 1e-3, 1e-3));
    }
    BundleEquations equations(scene->problem, structure, blocks, Kernel::kNone, dense_poses, start);
    const double before = equations.linearise();
    const auto predicted = equations.solve(0.0);
    ASSERT_TRUE(predicted);
    EXPECT_NEAR(*predicted, before, 0.01 * before);
    EXPECT_LT(equations.trial_cost(), 1e-4 * before);
  }
}

// Compares the minimum with free extrinsics and their prior with Ceres (numeric derivatives).
TEST(BundleEquations, ReachTheMinimumOfCeresWithFreeExtrinsics) {
  for (const std::size_t cameras : {2u, 4u}) {
    Random random(3, "extrinsics");
    BundleSpec spec;
    spec.cameras = cameras;
    spec.points = 80;
    spec.farthest = 8;
    const auto scene = scene::make_bundle_scene(spec, random);
    const BundleStructure structure = make_structure(scene->problem, squared_errors(scene->problem), {});
    RigBlocks blocks;
    blocks.push_back(std::make_unique<ExtrinsicsBlock>(prior_of(scene->rig)));
    BundleEquations equations(scene->problem, structure, blocks, Kernel::kHuber, 150, state_of(scene->problem));
    const LmSummary summary = minimise(equations, {.iterations = 200, .relative_decrease = 1e-13});
    ReprojectionProblem theirs = scene->problem;
    std::vector<SE3> T_cam_rig = prior_of(scene->rig).T_cam_rig;
    const double reference = ceres_reference::adjust_with_extrinsics(theirs, prior_of(scene->rig), T_cam_rig);
    ASSERT_TRUE(summary.usable());
    EXPECT_NEAR(summary.final_cost, reference, 1e-6 * reference);
    for (std::size_t c = 1; c < cameras; ++c) {
      EXPECT_LT(extrinsic_change(equations.state().rig.T_cam_rig[c], T_cam_rig[c]).norm(), 1e-4) << c;
    }
  }
}

}  // namespace
}  // namespace bslam::solver
