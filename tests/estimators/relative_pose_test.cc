#include "estimators/relative_pose.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "estimators/epipolar.h"
#include "geometry/triangulation.h"
#include "solver/scene.h"

namespace bslam::estimators {

namespace scene = solver::scene;
using camera::Rig;
using Eigen::Vector2d;
using Eigen::Vector3d;
using geometry::SE3;

namespace {

enum class Shape { kGeneral, kPlane };

struct Views {
  SE3 T_b_a;
  std::vector<BearingPair> pairs;
  std::vector<Vector3d> points_a;
  std::vector<std::uint8_t> outlier;
};

struct Spec {
  Shape shape = Shape::kGeneral;
  int count = 300;
  double half_angle = 0.7;  // rad, maximum angle to the axis of camera a
  double baseline = 0.4, angle = 0.1;
  double noise = 5e-4;  // radians
  double outlier_ratio = 0.0;
};

Views make_views(const Spec& spec, Random& random) {
  Views out;
  out.T_b_a = SE3(geometry::so3_exp(spec.angle * scene::random_direction(random)),
                  spec.baseline * scene::random_direction(random));
  const Vector3d normal = Vector3d(0.2, 0.1, -1).normalized();
  while (static_cast<int>(out.pairs.size()) < spec.count) {
    const Vector3d direction = scene::random_direction(random);
    if (geometry::angle_between(direction, Vector3d::UnitZ()) > spec.half_angle) continue;
    const double distance =
        spec.shape == Shape::kPlane ? -4.0 / normal.dot(direction) : 1.0 / random.uniform(1.0 / 12, 1.0 / 2);
    const Vector3d point = distance * direction;
    const auto noisy = [&](const Vector3d& v) {
      return (v.normalized() + spec.noise * Vector3d(random.normal(), random.normal(), random.normal())).normalized();
    };
    const bool outlier = random.uniform() < spec.outlier_ratio;
    out.pairs.push_back({noisy(point), outlier ? scene::random_direction(random) : noisy(out.T_b_a * point)});
    out.points_a.push_back(point);
    out.outlier.push_back(outlier);
  }
  return out;
}

void expect_right(const Views& views, const RelativePose& found) {
  EXPECT_LT(scene::rotation_error(found.T_b_a, views.T_b_a), 0.01);
  EXPECT_NEAR(found.T_b_a.translation().norm(), 1.0, 1e-12);
  EXPECT_LT(geometry::angle_between(found.T_b_a.translation(), views.T_b_a.translation()), 0.06);
}

TEST(RelativePose, EstimatesTheMotionInGeneralScenesWithOutliers) {
  Random random(1);
  for (const double outlier_ratio : {0.0, 0.3}) {
    for (int trial = 0; trial < 10; ++trial) {
      Spec spec;
      spec.outlier_ratio = outlier_ratio;
      const Views views = make_views(spec, random);
      const auto found = relative_pose(views.pairs, {}, Random(3, "r", static_cast<std::uint64_t>(trial)));
      ASSERT_TRUE(found) << trial;
      expect_right(views, *found);
      EXPECT_GT(found->num_inliers, 0.9 * (1 - outlier_ratio) * spec.count - 20);
      EXPECT_EQ(found->num_inliers, std::count(found->inlier.begin(), found->inlier.end(), 1));
      int near = 0;
      for (std::size_t i = 0; i < views.pairs.size(); ++i) {
        if (found->inlier[i] == 0 || views.outlier[i] != 0) continue;
        const Vector3d point = found->points_a[i] * views.T_b_a.translation().norm();
        near += (point - views.points_a[i]).norm() < 0.15 * views.points_a[i].norm();
      }
      EXPECT_GT(near, 0.8 * (1 - outlier_ratio) * spec.count - 20);
    }
  }
}

TEST(RelativePose, WorksWithBearingsBehindTheImagePlane) {
  Random random(2);
  for (int trial = 0; trial < 10; ++trial) {
    Spec spec;
    spec.half_angle = 1.9;
    spec.outlier_ratio = 0.2;
    const Views views = make_views(spec, random);
    const auto found = relative_pose(views.pairs, {}, Random(4));
    ASSERT_TRUE(found) << trial;
    expect_right(views, *found);
  }
}

TEST(RelativePose, IsCorrectOrFailsInPlanarScenes) {
  Random random(5);
  int right = 0;
  for (int trial = 0; trial < 20; ++trial) {
    Spec spec;
    spec.shape = Shape::kPlane;
    spec.baseline = 0.8;
    const Views views = make_views(spec, random);
    const auto found = relative_pose(views.pairs, {}, Random(6));
    if (!found) continue;
    ++right;
    expect_right(views, *found);
  }
  EXPECT_GT(right, 0);
}

// Points on a part of the robot stay where they are in the images.
TEST(RelativePose, PointsThatHaveNotMovedAreOutliersIfTheOthersHave) {
  constexpr std::size_t kUnmoved = 200;
  Random random(7);
  for (int trial = 0; trial < 10; ++trial) {
    Spec spec;
    spec.count = 180;
    spec.angle = 0;
    Views views = make_views(spec, random);
    for (std::size_t k = 0; k < kUnmoved; ++k) {
      const Vector3d bearing = Vector3d(random.uniform(-0.6, 0.6), random.uniform(0.2, 0.6), 1).normalized();
      views.pairs.insert(views.pairs.begin(), {bearing, bearing});
    }
    const Random sampling(3, "r", static_cast<std::uint64_t>(trial));
    EXPECT_FALSE(relative_pose(views.pairs, {}, sampling));  // they agree with every translation
    const auto found = relative_pose(views.pairs, {.leave_out_unmoved = true}, sampling);
    ASSERT_TRUE(found) << trial;
    expect_right(views, *found);
    ASSERT_EQ(found->inlier.size(), views.pairs.size());
    ASSERT_EQ(found->points_a.size(), views.pairs.size());
    for (std::size_t k = 0; k < kUnmoved; ++k) EXPECT_EQ(found->inlier[k], 0);
    for (std::size_t i = 0; i < views.pairs.size(); ++i) {
      if (found->inlier[i] == 0) continue;
      EXPECT_LT(geometry::angle_between(found->points_a[i], views.pairs[i].a), 0.01);
    }
  }
}

// Samples of such points have no solution, and OpenGV throws for some of them.
TEST(RelativePose, FailsIfNothingHasMoved) {
  Random random(8);
  std::vector<BearingPair> pairs;
  for (int k = 0; k < 200; ++k) {
    const Vector3d bearing = Vector3d(random.uniform(-0.6, 0.6), random.uniform(-0.6, 0.6), 1).normalized();
    pairs.push_back({bearing, bearing});
  }
  for (const bool leave_out : {false, true})
    EXPECT_FALSE(relative_pose(pairs, {.leave_out_unmoved = leave_out}, Random(3)));
}

TEST(RelativePose, FailsForPureRotation) {
  Random random(7);
  for (int trial = 0; trial < 10; ++trial) {
    Spec spec;
    spec.baseline = 1e-9;
    spec.angle = 0.2;
    EXPECT_FALSE(relative_pose(make_views(spec, random).pairs, {}, Random(8))) << trial;
  }
}

TEST(RelativePose, FailsWithLowParallaxOrTooFewPairs) {
  Random random(9);
  Spec spec;
  spec.baseline = 0.02;
  EXPECT_FALSE(relative_pose(make_views(spec, random).pairs, {}, Random(1)));
  spec.baseline = 0.4;
  spec.count = 30;
  EXPECT_FALSE(relative_pose(make_views(spec, random).pairs, {}, Random(1)));
  EXPECT_FALSE(relative_pose({}, {}, Random(1)));
}

TEST(RelativePose, FailsWithOnlyOutliers) {
  Random random(10);
  Spec spec;
  spec.outlier_ratio = 1.0;
  EXPECT_FALSE(relative_pose(make_views(spec, random).pairs, {}, Random(1)));
}

TEST(RelativePose, IsDeterministic) {
  Random random(11);
  Spec spec;
  spec.outlier_ratio = 0.3;
  const Views views = make_views(spec, random);
  const auto a = relative_pose(views.pairs, {}, Random(12)), b = relative_pose(views.pairs, {}, Random(12));
  ASSERT_TRUE(a && b);
  EXPECT_EQ(a->T_b_a.matrix(), b->T_b_a.matrix());
  EXPECT_EQ(a->inlier, b->inlier);
}

TEST(Epipolar, RefinementReachesTheTruthWithoutNoise) {
  Random random(13);
  Spec spec;
  spec.noise = 0.0;
  spec.half_angle = 1.7;
  const Views views = make_views(spec, random);
  EpipolarPose start{(geometry::so3_exp(Vector3d(0.01, -0.02, 0.01)) * views.T_b_a.rotation()).toRotationMatrix(),
                     (views.T_b_a.translation().normalized() + Vector3d(0.05, -0.04, 0.03)).normalized()};
  const std::vector<std::uint8_t> all(views.pairs.size(), 1);
  constexpr double kKnee = 1e-4;  // radians; a step is negligible relative to it
  const EpipolarPose found = refine_epipolar(start, views.pairs, all, kKnee);
  EXPECT_LT((found.R_b_a - views.T_b_a.matrix3()).norm(), 1e-9);
  EXPECT_LT((found.t_b_a - views.T_b_a.translation().normalized()).norm(), 1e-8);
  EXPECT_LT((midpoint_in_a(found, views.pairs[0]) * views.T_b_a.translation().norm() - views.points_a[0]).norm(), 1e-5);
}

}  // namespace
}  // namespace bslam::estimators
