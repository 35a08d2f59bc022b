#include "tracking/feature_budget.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "tracking/simulated_tracker.h"

namespace bslam::tracking {
namespace {

using geometry::Matrix6d;

constexpr std::size_t kMany = 6;

feature::FeatureOptions options(int per_image, int per_rig) {
  feature::FeatureOptions o;
  o.per_image = per_image;
  o.per_rig = per_rig;
  return o;
}

int sum_of(const std::vector<int>& budgets) { return std::accumulate(budgets.begin(), budgets.end(), 0); }
double sum_of(const std::vector<double>& fractions) { return std::accumulate(fractions.begin(), fractions.end(), 0.0); }

TEST(FeatureBudgets, AreEqualWithoutFractions) {
  EXPECT_EQ(feature_budgets(1, {}, {}, {}, options(1200, 3200)), std::vector<int>(1, 1200));
  EXPECT_EQ(feature_budgets(2, {}, {}, {}, options(1200, 3200)), std::vector<int>(2, 1200));
  EXPECT_EQ(feature_budgets(4, {}, {}, {}, options(1200, 3200)), std::vector<int>(4, 800));
  EXPECT_EQ(feature_budgets(4, {}, {}, {}, options(1200, 0)), std::vector<int>(4, 1200));
}

TEST(FeatureBudgets, DivideHalfOfTheBudgetByTheFractions) {
  EXPECT_EQ(feature_budgets(4, std::vector<double>{0.4, 0.3, 0.2, 0.1}, {}, {}, options(1200, 3200)),
            (std::vector<int>{1040, 880, 720, 560}));
  // The first camera would get 2000; the excess over its maximum goes to the others.
  EXPECT_EQ(feature_budgets(4, std::vector<double>{1, 0, 0, 0}, {}, {}, options(1200, 3200)),
            (std::vector<int>{1200, 667, 667, 667}));
}

TEST(FeatureBudgets, DivideTheBudgetOfSkippedCamerasAmongTheOthers) {
  const auto budgets = [](std::vector<std::uint8_t> out, int per_rig, std::vector<double> fractions = {}) {
    return feature_budgets(out.size(), fractions, out, out, options(1200, per_rig));
  };
  EXPECT_EQ(budgets({0, 1, 0, 0}, 3000), (std::vector<int>{1000, 0, 1000, 1000}));
  EXPECT_EQ(budgets({1, 0, 0, 0}, 3600, {0, 0.1, 0.2, 0.7}), (std::vector<int>{0, 1200, 1200, 1200}));
  EXPECT_EQ(budgets({1, 1, 0, 0}, 3600), (std::vector<int>{0, 0, 1800, 1800}));
  EXPECT_EQ(budgets({1, 1, 0, 1}, 3600), (std::vector<int>{0, 0, 2400, 0}));
  EXPECT_EQ(budgets({1, 0}, 3600), (std::vector<int>{0, 2400}));
  EXPECT_EQ(budgets({1, 0, 0}, 0), (std::vector<int>{0, 1800, 1800}));
  EXPECT_EQ(budgets({1, 1}, 3000), (std::vector<int>{0, 0}));
}

TEST(FeatureBudgets, KeepHalfOfTheEqualBudgetForExcludedCameras) {
  const std::vector<std::uint8_t> excluded{1, 1, 0, 1};  // excluded cameras keep half of the equal budget
  EXPECT_EQ(feature_budgets(4, std::vector<double>{0, 0, 1, 0}, {}, excluded, options(1200, 3600)),
            (std::vector<int>{450, 450, 2250, 450}));
}

TEST(FeatureBudgets, DoNotOscillateWithSlowCameras) {
  const std::vector<std::uint8_t> without_image{0, 0, 1, 1};  // in every second frame; these are not failing
  EXPECT_EQ(feature_budgets(4, {}, without_image, {}, options(1200, 3600)), (std::vector<int>{1200, 1200, 0, 0}));
}

TEST(FeatureBudgets, StayWithinTheirBoundsForAnyFractions) {
  Random random(3, "shares");
  for (int trial = 0; trial < 500; ++trial) {
    const std::size_t n = 1 + random.below(8);
    std::vector<double> fractions(n);
    std::vector<std::uint8_t> out(n);
    for (std::size_t c = 0; c < n; ++c) {
      fractions[c] = std::pow(random.uniform(), 4);
      out[c] = random.uniform() < 0.2;
    }
    const feature::FeatureOptions o = options(1000, 500 + static_cast<int>(random.below(9000)));
    const auto num_with_image = static_cast<int>(std::count(out.begin(), out.end(), 0));
    if (num_with_image == 0) continue;
    const std::vector<int> budgets = feature_budgets(n, fractions, out, out, o);
    const int of_rig = std::min(o.per_rig, static_cast<int>(n) * o.per_image);
    const int most = std::clamp((of_rig + num_with_image - 1) / num_with_image, o.per_image, 2 * o.per_image);
    const int total = std::min(of_rig, num_with_image * most);
    EXPECT_NEAR(sum_of(budgets), total, 0.5 * num_with_image);
    for (std::size_t c = 0; c < n; ++c) {
      EXPECT_LE(budgets[c], out[c] ? 0 : most);
      EXPECT_GE(budgets[c], out[c] ? 0 : total / (2 * num_with_image));
    }
  }
}

// Information per keypoint of each camera, unequal in the directions of the pose.
std::vector<Matrix6d> random_information(Random& random, std::size_t cameras) {
  std::vector<Matrix6d> out;
  for (std::size_t c = 0; c < cameras; ++c) {
    Eigen::Matrix<double, 6, 8> J;
    for (Eigen::Index i = 0; i < J.size(); ++i) J(i) = random.normal() * std::exp(random.normal());
    out.push_back(J * J.transpose());
  }
  return out;
}

Matrix6d weighed(const std::vector<Matrix6d>& each, const std::vector<double>& fractions) {
  Matrix6d all = Matrix6d::Zero();
  for (std::size_t c = 0; c < each.size(); ++c) all += fractions[c] * each[c];
  return all;
}

// Fractions after `frames` frames in which the information of camera c is its fraction of each[c].
std::vector<double> after_frames(int frames, const std::vector<Matrix6d>& each, std::vector<double> fractions) {
  const std::vector<std::uint8_t> has_image(each.size(), 1);
  for (int k = 0; k < frames; ++k) {
    std::vector<Matrix6d> information;
    for (std::size_t c = 0; c < each.size(); ++c) information.push_back(fractions[c] * each[c]);
    const double before = weighed(each, fractions).determinant();
    fractions = budget_fractions(fractions, information, has_image);
    EXPECT_NEAR(sum_of(fractions), 1.0, 1e-9);
    EXPECT_GE(weighed(each, fractions).determinant(), before * (1 - 1e-9));
  }
  return fractions;
}

TEST(BudgetFractions, MaximiseTheInformationAboutThePose) {
  Random random(1, "design");
  for (int trial = 0; trial < 10; ++trial) {
    const std::vector<Matrix6d> each = random_information(random, 2);
    const std::vector<double> fractions = after_frames(2000, each, {0.5, 0.5});
    double best = 0, best_fraction = 0;
    for (int i = 0; i <= 1000; ++i) {
      const double d = weighed(each, {0.001 * i, 1 - 0.001 * i}).determinant();
      if (d > best) best_fraction = 0.001 * i;
      best = std::max(best, d);
    }
    EXPECT_NEAR(fractions[0], best_fraction, 0.01);
  }
  after_frames(200, random_information(random, kMany), std::vector<double>(kMany, 1.0 / kMany));
}

TEST(BudgetFractions, FollowSlowly) {
  const std::vector<Matrix6d> information{Matrix6d::Identity(), 99 * Matrix6d::Identity()};
  const std::vector<double> fractions = budget_fractions({}, information, std::vector<std::uint8_t>{1, 1});
  EXPECT_LT(fractions[0], 0.5);
  EXPECT_GT(fractions[0], 0.4);
}

TEST(BudgetFractions, AreKeptForCamerasWithoutAnImage) {
  const std::vector<double> before{0.5, 0.2, 0.3};
  const std::vector<Matrix6d> information{9 * Matrix6d::Identity(), Matrix6d::Zero(), Matrix6d::Identity()};
  const std::vector<double> fractions = budget_fractions(before, information, std::vector<std::uint8_t>{1, 0, 1});
  EXPECT_EQ(fractions[1], 0.2);
  EXPECT_GT(fractions[0], 0.5);
  EXPECT_NEAR(sum_of(fractions), 1.0, 1e-12);
}

TEST(BudgetFractions, BecomeEqualIfThePoseIsUnknown) {
  std::vector<double> fractions{0.7, 0.1, 0.2};
  for (int k = 0; k < 100; ++k) fractions = budget_fractions(fractions, {}, std::vector<std::uint8_t>{1, 1, 1});
  for (const double s : fractions) EXPECT_NEAR(s, 1.0 / 3, 1e-3);
}

class TrackedFrame : public ::testing::Test {
 protected:
  TrackedFrame() : seen(world.sim.frame(FrameId(1), 0.1)) {
    SimulatedTracker tracker(world);
    frame = seen.frame;
    const std::vector<matching::AlignmentOptions> alignment(world.map.rig().size());
    const TrackInput input{.map = world.map,
                           .pyramids = pyramids,
                           .alignment = alignment,
                           .state = tracker.state,
                           .features = {world.sim.options().sigma_px}};
    ThreadPool pool(2);
    output = track(input, frame, tracker.options, pool);
    frame = output.frame;
  }
  map::SimulatedMap world = true_map(simulator(synthetic::default_rig()), 0.0, 1.0);
  std::vector<image::Pyramid> pyramids = map::flat_pyramids(4);
  synthetic::SimulatedFrame seen;
  frame::BundledFrame frame;
  TrackOutput output;
};

TEST_F(TrackedFrame, InformationEqualsThatOfThePoseSolver) {
  ASSERT_EQ(output.result.status, TrackStatus::kTracking);
  const auto information = information_by_camera(world.map, frame, output.matches, output.result.T_rig_world);
  ASSERT_EQ(information.size(), 4u);
  Matrix6d all = Matrix6d::Zero();
  for (const Matrix6d& i : information) all += i;
  const auto observations = pose_observations(world.map, frame, output.matches);
  solver::PoseSolverOptions accept_all;
  const auto solution =
      solver::solve_pose(frame::rig_of(world.map.rig(), frame), observations, output.result.T_rig_world, accept_all);
  ASSERT_GT(solution.num_inliers, static_cast<int>(0.99 * static_cast<double>(observations.size())));
  EXPECT_LT((all - solution.information).norm(), 0.02 * all.norm());
}

TEST_F(TrackedFrame, MovesFractionsToInformativeCameras) {
  const std::vector<double> fractions = budget_fractions({}, world.map, frame, output);
  EXPECT_NEAR(sum_of(fractions), 1.0, 1e-9);
  EXPECT_LT(fractions[0] + fractions[1], 0.5);  // two of the four cameras observe the same direction
  const std::vector<double> again = budget_fractions({}, world.map, frame, output);
  EXPECT_EQ(fractions, again);
}

TEST_F(TrackedFrame, ReducesTheFractionOfACameraWithoutMatches) {
  output.matches[2].clear();
  const std::vector<double> fractions = budget_fractions({}, world.map, frame, output);
  EXPECT_LT(fractions[2], 0.25);
}

TEST_F(TrackedFrame, ReducesTheFractionOfAnExcludedCamera) {
  output.matches[2].clear();
  output.result.cameras[2].excluded = true;
  frame.cameras[2].state = image::ImageState::kMissing;
  EXPECT_LT(budget_fractions({}, world.map, frame, output)[2], 0.25);
}

}  // namespace
}  // namespace bslam::tracking
