#include "feature/subpixel.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

#include "synthetic_scene.h"

namespace bslam::feature {
namespace {

using testing::Similarity;
using testing::view_of;

double median(std::vector<double>& values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

struct Error {
  double whole_px, refined_px;  // medians over pairs of corners
};

// Corners of two views of one scene, paired within 2.2 pixels under the true warp.
Error measure(const cv::Mat& scene, const Similarity& warp, double noise) {
  FastDetector detector;
  std::vector<Corner> first, second;
  Similarity none;
  none.size = warp.size;
  const cv::Mat a = testing::render(scene, none, 0, 1, 0, 1, 7), b = testing::render(scene, warp, 0, 1, 0, noise, 11);
  detector.detect(view_of(a), 20, 15, first);
  detector.detect(view_of(b), 20, 15, second);
  const auto refined = [](const cv::Mat& image, const Corner& c) {
    const Eigen::Vector2f offset = refine(view_of(image), c.x, c.y);
    return cv::Point2d(c.x + static_cast<double>(offset.x()), c.y + static_cast<double>(offset.y()));
  };
  std::vector<double> whole, fine;
  for (const Corner& c : first) {
    const cv::Point2d p = warp({static_cast<double>(c.x), static_cast<double>(c.y)});
    const auto distance = [&](const Corner& k) { return std::hypot(k.x - p.x, k.y - p.y); };
    const auto best = std::min_element(second.begin(), second.end(),
                                       [&](const Corner& k, const Corner& l) { return distance(k) < distance(l); });
    if (best == second.end() || distance(*best) > 2.2) continue;
    const cv::Point2d difference = warp(refined(a, c)) - refined(b, *best);
    whole.push_back(distance(*best));
    fine.push_back(std::hypot(difference.x, difference.y));
  }
  EXPECT_GT(whole.size(), 500u);
  return {median(whole), median(fine)};
}

TEST(Subpixel, HalvesTheErrorOfPositions) {
  const cv::Mat scene = testing::make_scene(1800, 1200, 3);
  const cv::Size size(640, 420);
  const struct {
    const char* name;
    Similarity warp;
    double noise;
  } cases[] = {{"half-pixel shift", {0, 1, 0.5, 0.5, size}, 0},
               {"shift", {0, 1, 0.3, 0.7, size}, 3},
               {"rotation", {0.5, 1, 0.1, 0.2, size}, 2},
               {"larger", {0, 1.1, 0.2, 0.4, size}, 1},
               {"smaller and rotated", {0.3, 0.9, 0.2, 0.3, size}, 2}};
  for (const auto& c : cases) {
    const Error error = measure(scene, c.warp, c.noise);
    std::printf("%-20s whole pixels %.3f px, refined %.3f px\n", c.name, error.whole_px, error.refined_px);
    EXPECT_LT(error.refined_px, 0.6 * error.whole_px) << c.name;
    EXPECT_LT(error.refined_px, 0.4) << c.name;
  }
}

TEST(Subpixel, TracksABlobAcrossAPixel) {
  for (double shift = -0.4; shift <= 0.41; shift += 0.1) {
    cv::Mat image(41, 41, CV_8U);
    for (int y = 0; y < 41; ++y) {
      for (int x = 0; x < 41; ++x) {
        const double dx = x - 20 - shift, dy = y - 20 + 0.5 * shift;
        image.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(40 + 180 * std::exp(-(dx * dx + dy * dy) / 4.5));
      }
    }
    const Eigen::Vector2f offset = refine(view_of(image), 20, 20);
    // A broad blob is the most difficult case: the window biases the centroid.
    EXPECT_NEAR(offset.x(), shift, 0.5 * std::abs(shift) + 0.02);
    EXPECT_NEAR(offset.y(), -0.5 * shift, 0.25 * std::abs(shift) + 0.02);
  }
}

TEST(Subpixel, IsZeroWithoutACorner) {
  EXPECT_EQ(refine(view_of(cv::Mat(40, 40, CV_8U, cv::Scalar(7))), 20, 20), Eigen::Vector2f::Zero());
}

TEST(Subpixel, VectorAndScalarKernelsGiveTheSameOffset) {
  const cv::Mat scene = testing::make_scene(200, 150, 3);
  for (int y = 15; y < 135; y += 3) {
    for (int x = 15; x < 185; x += 3) {
      ASSERT_EQ(refine(view_of(scene), x, y), refine(view_of(scene), x, y, scalar_fast_kernels()));
    }
  }
}

}  // namespace
}  // namespace bslam::feature
