#include "solver/similarity_ransac.h"

#include <numeric>

#include <gtest/gtest.h>

#include "solver/scene.h"

namespace bslam::solver {
namespace {

using geometry::ScaleMode;
using geometry::Sim3;
using scene::Models;

struct MatchScene {
  Sim3 S_a_b;  // truth
  std::vector<SimilarityMatch> matches;
  std::vector<std::uint8_t> outlier;
};

struct Seen {
  bool any = false;
  CameraIndex camera;
  Vector2d pixel = Vector2d::Zero();
};

// By one of the cameras that have the point (rig frame) in their image.
Seen see_by_any(const Rig& rig, const Vector3d& point, Random& random) {
  const std::size_t first = random.below(static_cast<std::uint32_t>(rig.size()));
  for (std::size_t k = 0; k < rig.size(); ++k) {
    const std::size_t i = (first + k) % rig.size();
    if (const auto pixel = scene::see(rig, i, SE3(), point)) return {true, CameraIndex(i), *pixel};
  }
  return {};
}

// Landmarks seen from two places 0.5 m and 0.2 rad apart, each by some camera in either, b in another unit. `noise` in
// pixels; with it the points are off by 1 % in depth. Outliers match the landmark of another match.
MatchScene make_match_scene(const Rig& rig, int count, double scale, double noise, double outlier_share,
                            Random& random) {
  MatchScene out;
  const SE3 T_a_b = SE3::exp(scene::random_twist(random, 0.2, 0.5));
  out.S_a_b = Sim3(scale, T_a_b.rotation(), T_a_b.translation());
  const auto jitter = [&]() -> Vector2d { return noise * Vector2d(random.normal(), random.normal()); };
  while (static_cast<int>(out.matches.size()) < count) {
    const Vector3d point_a = scene::random_visible_point(rig, SE3(), random, 15);
    const Vector3d point_b = out.S_a_b.inverse() * point_a;
    const Seen in_a = see_by_any(rig, point_a, random), in_b = see_by_any(rig, point_b, random);
    if (!in_a.any || !in_b.any) continue;
    out.matches.push_back({(1 + 0.01 * noise * random.normal()) * point_a,
                           (1 + 0.01 * noise * random.normal()) * point_b, in_a.camera, in_b.camera,
                           in_a.pixel + jitter(), in_b.pixel + jitter(), 1.0, 1.0});
    out.outlier.push_back(0);
  }
  const std::vector<SimilarityMatch> right = out.matches;
  for (std::size_t i = 0; i < right.size(); ++i) {
    if (random.uniform() >= outlier_share) continue;
    const SimilarityMatch& other = right[random.below(static_cast<std::uint32_t>(count))];
    if (&other == &right[i]) continue;
    out.matches[i].point_b = other.point_b;
    out.matches[i].camera_b = other.camera_b;
    out.matches[i].pixel_b = other.pixel_b;
    out.outlier[i] = 1;
  }
  return out;
}

double rotation_error(const Sim3& x, const Sim3& y) { return x.rotation().angularDistance(y.rotation()); }
double translation_error(const Sim3& x, const Sim3& y) { return (x.translation() - y.translation()).norm(); }

struct RigCase {
  std::size_t cameras;
  Models models;
};
class SimilarityOnRig : public testing::TestWithParam<RigCase> {};

TEST_P(SimilarityOnRig, RecoversTruthFromNoiseAndSixtyPercentOutliers) {
  const Rig rig = scene::make_rig(GetParam().cameras, GetParam().models);
  Random random(1, "similarity");
  for (const ScaleMode mode : {ScaleMode::kFixed, ScaleMode::kFree}) {
    for (int trial = 0; trial < 20; ++trial) {
      // Several cameras observe their baselines: their scale drifts little.
      const double most = mode == ScaleMode::kFixed ? 1.0 : rig.size() == 1 ? 4.0 : 1.25;
      const double scale = std::pow(most, random.uniform(-1, 1));
      const auto scene = make_match_scene(rig, 120, scale, 0.7, 0.6, random);
      const auto estimate =
          ransac_similarity(rig, scene.matches, mode, {}, Random(2, "t", static_cast<std::uint64_t>(trial)));
      ASSERT_TRUE(estimate) << trial;
      EXPECT_LT(rotation_error(estimate->S_a_b, scene.S_a_b), 0.01) << trial;
      EXPECT_LT(translation_error(estimate->S_a_b, scene.S_a_b), 0.08) << trial;
      EXPECT_NEAR(estimate->S_a_b.scale() / scale, 1.0, mode == ScaleMode::kFixed ? 0.0 : 0.03) << trial;
      int wrong = 0, inliers = 0;
      for (std::size_t i = 0; i < scene.outlier.size(); ++i) {
        wrong += scene.outlier[i] != 0 && estimate->inlier[i] != 0;
        inliers += scene.outlier[i] == 0;
      }
      EXPECT_LE(wrong, 1) << trial;
      EXPECT_GT(estimate->num_inliers, 0.8 * inliers) << trial;
      EXPECT_EQ(estimate->num_inliers, std::accumulate(estimate->inlier.begin(), estimate->inlier.end(), 0));
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Rigs, SimilarityOnRig,
                         testing::Values(RigCase{1, Models::kPinhole}, RigCase{1, Models::kFisheye},
                                         RigCase{2, Models::kRadTan}, RigCase{3, Models::kMixed},
                                         RigCase{4, Models::kRadTan}, RigCase{4, Models::kFisheye}));

TEST(Similarity, IsExactWithoutNoise) {
  Random random(3);
  for (const std::size_t cameras : {1u, 3u}) {
    const Rig rig = scene::make_rig(cameras, Models::kMixed);
    const auto scene = make_match_scene(rig, 60, 2.5, 0.0, 0.3, random);
    const auto estimate = ransac_similarity(rig, scene.matches, ScaleMode::kFree, {}, Random(1));
    ASSERT_TRUE(estimate);
    EXPECT_LT((estimate->S_a_b * scene.S_a_b.inverse()).log().norm(), 1e-6);
  }
}

// The refinement reaches the minimum of both errors: no small step in any direction makes them smaller.
TEST(Similarity, EndsAtTheMinimumOfBothReprojectionErrors) {
  Random random(4);
  const Rig rig = scene::make_rig(2, Models::kRadTan);
  const auto scene = make_match_scene(rig, 80, 0.9, 0.4, 0.0, random);
  const auto estimate = ransac_similarity(rig, scene.matches, ScaleMode::kFree, {}, Random(1));
  ASSERT_TRUE(estimate);
  const auto cost = [&](const Sim3& S_a_b) {
    double sum = 0.0;
    for (std::size_t i = 0; i < scene.matches.size(); ++i) {
      const SimilarityMatch& m = scene.matches[i];
      if (estimate->inlier[i] == 0) continue;
      const auto a = ReprojectionResidual::error_only(rig, m.camera_a, SE3(), S_a_b * m.point_b, m.pixel_a);
      const auto b = ReprojectionResidual::error_only(rig, m.camera_b, SE3(), S_a_b.inverse() * m.point_a, m.pixel_b);
      sum += huber_cost(a->squaredNorm()) + huber_cost(b->squaredNorm());
    }
    return sum;
  };
  const double least = cost(estimate->S_a_b);
  for (int k = 0; k < 7; ++k) {
    for (const double step : {-1e-3, 1e-3}) {
      EXPECT_GT(cost(estimate->S_a_b.perturbed(step * geometry::Vector7d::Unit(k))), least) << k;
    }
  }
}

TEST(Similarity, KeepsScaleOneExactlyWhereItIsFixed) {
  Random random(5);
  const Rig rig = scene::make_rig(2, Models::kPinhole);
  const auto scene = make_match_scene(rig, 80, 1.0, 1.0, 0.2, random);
  const auto estimate = ransac_similarity(rig, scene.matches, ScaleMode::kFixed, {}, Random(1));
  ASSERT_TRUE(estimate);
  EXPECT_EQ(estimate->S_a_b.scale(), 1.0);
}

TEST(Similarity, AnswersNothingForOutliersAlone) {
  Random random(6);
  for (const std::size_t cameras : {1u, 2u, 4u}) {
    const Rig rig = scene::make_rig(cameras, Models::kRadTan);
    for (int trial = 0; trial < 20; ++trial) {
      const auto scene = make_match_scene(rig, 120, 1.0, 1.0, 1.0, random);
      for (const ScaleMode mode : {ScaleMode::kFixed, ScaleMode::kFree}) {
        EXPECT_FALSE(ransac_similarity(rig, scene.matches, mode, {}, Random(1)));
      }
    }
  }
}

TEST(Similarity, AnswersNothingForTooFewMatchesOrPointsAlongOneRay) {
  Random random(7);
  const Rig rig = scene::make_rig(1, Models::kPinhole);
  EXPECT_FALSE(ransac_similarity(rig, {}, ScaleMode::kFree, {}, Random(1)));
  const auto scene = make_match_scene(rig, 14, 1.0, 0.0, 0.0, random);
  EXPECT_FALSE(ransac_similarity(rig, scene.matches, ScaleMode::kFree, {}, Random(1)));
  std::vector<SimilarityMatch> line;
  for (int i = 0; i < 40; ++i) {
    const Vector3d point = (2.0 + 0.5 * i) * Vector3d(0.2, -0.1, 1) + 1e-4 * scene::random_direction(random);
    const Vector2d pixel = *rig.camera(0).project(point);
    line.push_back({point, point, CameraIndex(0), CameraIndex(0), pixel, pixel, 1.0, 1.0});
  }
  EXPECT_FALSE(ransac_similarity(rig, line, ScaleMode::kFree, {}, Random(1)));
}

TEST(Similarity, RepeatsItselfToTheBit) {
  Random random(8);
  const Rig rig = scene::make_rig(3, Models::kMixed);
  const auto scene = make_match_scene(rig, 100, 1.1, 1.0, 0.4, random);
  const auto x = ransac_similarity(rig, scene.matches, ScaleMode::kFree, {}, Random(5));
  const auto y = ransac_similarity(rig, scene.matches, ScaleMode::kFree, {}, Random(5));
  ASSERT_TRUE(x && y);
  EXPECT_EQ(x->S_a_b.translation(), y->S_a_b.translation());
  EXPECT_EQ(x->S_a_b.rotation().coeffs(), y->S_a_b.rotation().coeffs());
  EXPECT_EQ(x->S_a_b.scale(), y->S_a_b.scale());
  EXPECT_EQ(x->inlier, y->inlier);
}

}  // namespace
}  // namespace bslam::solver
