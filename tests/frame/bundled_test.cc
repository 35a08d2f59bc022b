#include "frame/bundled.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "base/random.h"

namespace bslam::frame {
namespace {

struct Sample {
  std::vector<std::size_t> counts;
  std::vector<std::vector<KeypointRef>> matched;
  std::vector<std::optional<BundledPoint>> points;
  Bundled bundled() const { return Bundled(counts, matched, points); }
};

// Random groups over cameras with different numbers of keypoints, among them cameras without any.
Sample random_sample(Random& random) {
  Sample sample;
  const std::size_t cameras = 1 + random.below(5);
  std::vector<std::vector<std::size_t>> free(cameras);
  for (std::size_t c = 0; c < cameras; ++c) {
    sample.counts.push_back(random.below(4) == 0 ? 0 : random.below(60));
    for (std::size_t k = 0; k < sample.counts[c]; ++k) free[c].push_back(k);
  }
  for (int i = 0; i < 20; ++i) {
    std::vector<KeypointRef> group;
    for (std::size_t c = 0; c < cameras; ++c) {
      if (free[c].empty() || random.below(2) == 0) continue;
      group.push_back(
          {CameraIndex(c), KeypointIndex(free[c][random.below(static_cast<std::uint32_t>(free[c].size()))])});
    }
    if (group.size() < 2) continue;
    for (const KeypointRef& r : group) std::erase(free[r.camera.index()], r.keypoint.index());
    sample.matched.push_back(group);
    sample.points.emplace_back();
    if (random.below(2) == 0)
      sample.points.back() = BundledPoint{{0, 0, static_cast<double>(i)}, Eigen::Matrix3d::Identity()};
  }
  return sample;
}

TEST(Bundled, AssignsEveryKeypointToExactlyOneFeature) {
  Random random(1);
  for (int round = 0; round < 200; ++round) {
    const Sample sample = random_sample(random);
    const Bundled bundled = sample.bundled();
    std::vector<KeypointRef> all;
    for (std::size_t f = 0; f < bundled.size(); ++f) {
      for (const KeypointRef& r : bundled.keypoints(FeatureId(f))) {
        all.push_back(r);
        EXPECT_EQ(bundled.feature(r), FeatureId(f));
      }
    }
    std::vector<KeypointRef> expected;
    for (std::size_t c = 0; c < sample.counts.size(); ++c) {
      for (std::size_t k = 0; k < sample.counts[c]; ++k) expected.push_back({CameraIndex(c), KeypointIndex(k)});
    }
    std::sort(all.begin(), all.end());
    EXPECT_EQ(all, expected);
  }
}

TEST(Bundled, HasAtMostOneKeypointPerCameraInOrder) {
  Random random(2);
  for (int round = 0; round < 200; ++round) {
    const Bundled bundled = random_sample(random).bundled();
    for (std::size_t f = 0; f < bundled.size(); ++f) {
      const auto refs = bundled.keypoints(FeatureId(f));
      EXPECT_EQ(refs.size() >= 2, bundled.is_matched(FeatureId(f)));
      EXPECT_EQ(std::ranges::adjacent_find(refs, std::greater_equal(), &KeypointRef::camera), refs.end());
    }
  }
}

TEST(Bundled, CountsUniqueFeaturesAsMonocularPlusMatched) {
  Random random(3);
  for (int round = 0; round < 200; ++round) {
    const Sample sample = random_sample(random);
    const Bundled bundled = sample.bundled();
    std::size_t keypoints = 0, bundled_away = 0;
    for (const std::size_t count : sample.counts) keypoints += count;
    for (const auto& group : sample.matched) bundled_away += group.size() - 1;
    EXPECT_EQ(bundled.size(), keypoints - bundled_away);
    EXPECT_EQ(bundled.size(), bundled.num_monocular() + bundled.num_matched());
    EXPECT_EQ(bundled.num_matched(), sample.matched.size());
  }
}

TEST(Bundled, KeepsThePointsOfMatchedFeatures) {
  Random random(4);
  const Sample sample = random_sample(random);
  const Bundled bundled = sample.bundled();
  for (std::size_t f = 0; f < bundled.size(); ++f) {
    const auto& point = bundled.point(FeatureId(f));
    const bool expected = f < sample.points.size() && sample.points[f].has_value();
    ASSERT_EQ(point.has_value(), expected);
    if (expected) {
      EXPECT_EQ(point->point_rig, sample.points[f]->point_rig);
    }
  }
}

TEST(Bundled, IsEmptyWithoutKeypoints) {
  EXPECT_EQ(Bundled().size(), 0u);
  const std::vector<std::size_t> counts = {0, 0};
  EXPECT_EQ(Bundled(counts, {}, {}).size(), 0u);
}

TEST(BundledDeathTest, RejectsAKeypointInTwoFeatures) {
  const std::vector<std::size_t> counts = {2, 2};
  const KeypointRef a{CameraIndex(0), KeypointIndex(0)}, b{CameraIndex(1), KeypointIndex(0)},
      c{CameraIndex(1), KeypointIndex(1)};
  const std::vector<std::vector<KeypointRef>> twice = {{a, b}, {a, c}}, same_camera = {{b, c}};
  EXPECT_DEATH(Bundled(counts, twice, std::vector<std::optional<BundledPoint>>(2)), "two features");
  EXPECT_DEATH(Bundled(counts, same_camera, std::vector<std::optional<BundledPoint>>(1)), "distinct cameras");
}

}  // namespace
}  // namespace bslam::frame
