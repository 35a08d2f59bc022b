#include "frame/feature_grid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "base/random.h"

namespace bslam::frame {
namespace {

constexpr int kWidth = 640, kHeight = 480;

void add(feature::Detections& keypoints, double x, double y, Random& random) {
  keypoints.pixel.emplace_back(static_cast<float>(x), static_cast<float>(y));
  keypoints.level.push_back(static_cast<std::uint8_t>(random.below(8)));
}

// Random positions, whole and half pixels on the borders of cells, corners of the image, and a little outside of it.
feature::Keypoints random_keypoints(Random& random) {
  feature::Detections keypoints;
  for (int i = 0; i < 600; ++i)
    add(keypoints, random.uniform(-0.5, kWidth - 0.5), random.uniform(-0.5, kHeight - 0.5), random);
  for (int i = 0; i < 200; ++i) add(keypoints, random.below(kWidth) - 0.5, random.below(kHeight) - 0.5, random);
  for (int i = 0; i < 100; ++i) add(keypoints, random.uniform(-5, kWidth + 5), random.uniform(-5, kHeight + 5), random);
  for (const double x : {0, kWidth - 1}) {
    for (const double y : {0, kHeight - 1}) add(keypoints, x, y, random);
  }
  return keypoints;
}

std::vector<std::uint32_t> brute_force(const feature::Keypoints& keypoints, const Eigen::Vector2d& pixel, double radius,
                                       int low, int high) {
  std::vector<std::uint32_t> found;
  for (std::uint32_t k = 0; k < keypoints.size(); ++k) {
    const Eigen::Vector2f offset = keypoints.pixel[k] - pixel.cast<float>();
    if (offset.cwiseAbs().maxCoeff() > static_cast<float>(radius)) continue;
    if (keypoints.level[k] >= low && keypoints.level[k] <= high) found.push_back(k);
  }
  return found;
}

TEST(FeatureGrid, AgreesWithBruteForce) {
  Random random(1);
  for (int round = 0; round < 5; ++round) {
    const feature::Keypoints keypoints = random_keypoints(random);
    const FeatureGrid grid(keypoints, kWidth, kHeight);
    std::size_t total = 0;
    for (int i = 0; i < 2000; ++i) {
      Eigen::Vector2d pixel(random.uniform(-40, kWidth + 40), random.uniform(-40, kHeight + 40));
      if (i % 4 == 0) pixel = pixel.array().round() + 0.5;
      const double radius = i % 10 == 0 ? 700 : (i % 4 == 0 ? random.below(30) : random.uniform(0, 40));
      const int low = static_cast<int>(random.below(8)), high = static_cast<int>(random.below(8));
      std::vector<std::uint32_t> found;
      grid.near(keypoints, pixel, radius, low, high, found);
      std::sort(found.begin(), found.end());
      const auto expected = brute_force(keypoints, pixel, radius, low, high);
      ASSERT_EQ(found, expected) << pixel.transpose() << " radius " << radius;
      total += found.size();
    }
    EXPECT_GT(total, 1000u);
  }
}

TEST(FeatureGrid, AppendsToTheOutput) {
  Random random(2);
  feature::Detections detections;
  add(detections, 100, 100, random);
  const feature::Keypoints keypoints(std::move(detections));
  const FeatureGrid grid(keypoints, kWidth, kHeight);
  std::vector<std::uint32_t> found = {7};
  grid.near(keypoints, {101, 99}, 1.0, 0, 7, found);
  EXPECT_EQ(found, (std::vector<std::uint32_t>{7, 0}));
}

TEST(FeatureGrid, FindsNothingWithoutKeypoints) {
  std::vector<std::uint32_t> found;
  FeatureGrid().near({}, {10, 10}, 100, 0, 7, found);
  FeatureGrid({}, kWidth, kHeight).near({}, {10, 10}, 100, 0, 7, found);
  EXPECT_TRUE(found.empty());
}

}  // namespace
}  // namespace bslam::frame
