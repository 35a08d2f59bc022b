#include "frame/bundled.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>

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

TEST(Bundled, IsMadeOfItsArraysAgain) {
  Random random(3);
  for (int round = 0; round < 100; ++round) {
    const Sample sample = random_sample(random);
    const Bundled bundled = sample.bundled();
    const auto again = Bundled::from_arrays(sample.counts, bundled.num_matched(), bundled.arrays(), sample.points);
    ASSERT_TRUE(again.has_value());
    ASSERT_EQ(again->size(), bundled.size());
    for (std::size_t f = 0; f < bundled.size(); ++f) {
      const auto a = bundled.keypoints(FeatureId(f)), b = again->keypoints(FeatureId(f));
      ASSERT_TRUE(std::equal(a.begin(), a.end(), b.begin(), b.end()));
      for (const KeypointRef r : a) ASSERT_EQ(again->feature(r), FeatureId(f));
      ASSERT_EQ(again->point(FeatureId(f)).has_value(), bundled.point(FeatureId(f)).has_value());
    }
  }
}

// Any change of one number in the arrays is found.
TEST(Bundled, IsNotMadeOfArraysThatContradictEachOther) {
  Random random(4);
  int tried = 0;
  for (int round = 0; round < 400; ++round) {
    const Sample sample = random_sample(random);
    const Bundled bundled = sample.bundled();
    if (bundled.size() == 0) continue;
    std::vector<KeypointRef> refs = bundled.arrays().refs.copy();
    std::vector<std::uint32_t> begin = bundled.arrays().begin.copy();
    std::vector<FeatureId> feature = bundled.arrays().feature.copy();
    std::size_t matched = bundled.num_matched();
    const auto any = [&](std::size_t n) { return random.below(static_cast<std::uint32_t>(n)); };
    const std::int32_t wild = std::array{-1, 0, 3, 70, 0x7fffffff}[random.below(5)];
    const auto change = [&](auto& id) {
      id = std::remove_reference_t<decltype(id)>(id.value() == wild ? std::int32_t{1234567} : wild);
    };
    switch (random.below(5)) {
      case 0:
        change(refs[any(refs.size())].camera);
        break;
      case 1:
        change(refs[any(refs.size())].keypoint);
        break;
      case 2:
        change(feature[any(feature.size())]);
        break;
      case 3:
        begin[any(begin.size())] += static_cast<std::uint32_t>(1 + random.below(3));
        break;
      default:
        ++matched;
    }
    const Bundled::Arrays arrays{std::move(refs), std::move(begin), std::move(feature)};
    EXPECT_FALSE(Bundled::from_arrays(sample.counts, matched, arrays, {}).has_value()) << round;
    ++tried;
  }
  EXPECT_GT(tried, 300);
}

TEST(Bundled, CanLoseItsPoints) {
  Random random(5);
  const Bundled bundled = random_sample(random).bundled();
  ASSERT_TRUE(bundled.has_points());
  const Bundled without = bundled.without_points();
  EXPECT_EQ(without.arrays().refs.data(), bundled.arrays().refs.data());
  for (std::size_t f = 0; f < without.size(); ++f) EXPECT_FALSE(without.point(FeatureId(f)).has_value());
}

}  // namespace
}  // namespace bslam::frame
