// Windows, smoothing, orientation and binary tests.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "base/random.h"
#include "feature/brief_pattern.h"
#include "feature/hamming.h"
#include "feature/orientation.h"
#include "feature/smoothing.h"
#include "feature/window.h"
#include "synthetic_scene.h"

namespace bslam::feature {
namespace {

using testing::Similarity;
using testing::view_of;

constexpr double kPi = std::numbers::pi;

double wrapped(double angle) { return std::remainder(angle, 2 * kPi); }

TEST(Window, SamplesBetweenPixels) {
  cv::Mat ramp(60, 60, CV_8U);
  for (int y = 0; y < 60; ++y) {
    for (int x = 0; x < 60; ++x) ramp.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(2 * x + y);
  }
  const Window window = sample_window(view_of(ramp), 30.25f, 28.75f);
  const Patch patch = sample_patch(view_of(ramp), 30.25f, 28.75f);
  const auto truth = [](double x, double y) { return 2 * (30.25 + x) + 28.75 + y; };
  for (int j = 0; j < kWindowRows; ++j) {
    for (int i = 0; i < kWindowRows; ++i) {
      EXPECT_NEAR(window[static_cast<std::size_t>(j * kWindowStride + i)], truth(i - kWindowRadius, j - kWindowRadius),
                  0.51);
    }
  }
  for (int j = 0; j < kPatchSize; ++j) {
    for (int i = 0; i < kPatchSize; ++i) {
      EXPECT_NEAR(patch[static_cast<std::size_t>(j * kPatchSize + i)], truth(i - 4.5, j - 4.5), 0.51);
    }
  }
}

TEST(Smoother, FiltersWithItsKernels) {
  const cv::Mat scene = testing::make_scene(133, 71, 2);
  Smoother smoother;
  image::Image out;
  const auto check = [&](const std::vector<int>& kernel) {
    const int half = static_cast<int>(kernel.size()) / 2;
    int total = 0;
    for (const int w : kernel) total += w;
    for (int y = 0; y < scene.rows; ++y) {
      for (int x = 0; x < scene.cols; ++x) {
        int sum = total * total / 2;
        for (int j = -half; j <= half; ++j) {
          for (int i = -half; i <= half; ++i) {
            sum += kernel[static_cast<std::size_t>(i + half)] * kernel[static_cast<std::size_t>(j + half)] *
                   scene.at<std::uint8_t>(std::clamp(y + j, 0, scene.rows - 1), std::clamp(x + i, 0, scene.cols - 1));
          }
        }
        ASSERT_EQ(out.view().at(x, y), sum / (total * total));
      }
    }
  };
  smoother.soften(view_of(scene), out);
  check({1, 2, 1});
  smoother.smooth(view_of(scene), out);
  check({1, 2, 3, 4, 3, 2, 1});
}

TEST(Smoother, DoesNotOverflowForWhiteImages) {
  Smoother smoother;
  image::Image out;
  smoother.smooth(view_of(cv::Mat(5, 3, CV_8U, cv::Scalar(255))), out);
  for (int y = 0; y < 5; ++y) {
    for (int x = 0; x < 3; ++x) EXPECT_EQ(out.view().at(x, y), 255);
  }
}

TEST(Orientation, VectorAndScalarMomentsAreEqual) {
  Random random(6);
  for (int round = 0; round < 50; ++round) {
    Window window;
    for (std::uint8_t& grey : window) grey = static_cast<std::uint8_t>(random.below(256));
    ASSERT_EQ(intensity_moments(window), intensity_moments_scalar(window));
  }
}

TEST(Orientation, IsMeasuredFromXTowardsY) {
  const auto angle_of = [](int dx, int dy) {
    Window window{};
    window[static_cast<std::size_t>((kWindowRadius + dy) * kWindowStride + kWindowRadius + dx)] = 255;
    return orientation(intensity_moments(window));
  };
  EXPECT_FLOAT_EQ(angle_of(10, 0), 0.0f);
  EXPECT_NEAR(angle_of(0, 10), kPi / 2, 1e-6);
  EXPECT_NEAR(angle_of(-7, 7), 3 * kPi / 4, 1e-6);
  EXPECT_EQ(orientation(intensity_moments(Window{})), 0.0f);
}

struct Described {
  double angle;
  Descriptor descriptor;
};

Described describe(const Describer& describer, const cv::Mat& view, const cv::Point2d& p) {
  Smoother smoother;
  image::Image smooth;
  smoother.smooth(view_of(view), smooth);
  const auto x = static_cast<float>(p.x), y = static_cast<float>(p.y);
  const float angle = orientation(intensity_moments(sample_window(view_of(view), x, y)));
  return {angle, describer.describe(sample_window(smooth.view(), x, y), angle)};
}

TEST(Description, RotatesWithTheImage) {
  const cv::Mat scene = testing::make_scene(700, 700, 12);
  const Describer describer;
  Similarity none;
  none.size = {301, 301};
  const cv::Mat upright = testing::render(scene, none);
  std::vector<double> angle_error, same, different;
  for (const double turn : {0.3, 1.0, 1.7, 2.6, -2.0, -0.8}) {
    Similarity warp = none;
    warp.angle = turn;
    const cv::Mat rotated = testing::render(scene, warp);
    for (double y = 90; y < 210; y += 17.3) {
      for (double x = 90; x < 210; x += 17.3) {
        const Described a = describe(describer, upright, {x, y}), b = describe(describer, rotated, warp({x, y}));
        const Described c = describe(describer, rotated, warp({x + 25, y}));
        angle_error.push_back(std::abs(wrapped(b.angle - a.angle - turn)));
        same.push_back(hamming(a.descriptor, b.descriptor));
        different.push_back(hamming(a.descriptor, c.descriptor));
      }
    }
  }
  const auto median = [](std::vector<double>& v) {
    std::nth_element(v.begin(), v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2), v.end());
    return v[v.size() / 2];
  };
  EXPECT_LT(median(angle_error), 0.03);
  EXPECT_LT(median(same), 25);
  EXPECT_GT(median(different), 90);
}

TEST(BriefPattern, AreSpreadAndWeaklyCorrelated) {
  const auto tests = make_brief_pattern();
  double worst = 0, square = 0;
  for (std::size_t i = 0; i < tests.size(); ++i) {
    for (const auto& [x, y] : {std::pair(tests[i].x1, tests[i].y1), std::pair(tests[i].x2, tests[i].y2)}) {
      EXPECT_LE(x * x + y * y, kWindowRadius * kWindowRadius);
    }
    for (std::size_t j = 0; j < i; ++j) {
      const double r = test_correlation(tests[i], tests[j]);
      worst = std::max(worst, std::abs(r));
      square += r * r;
    }
  }
  std::printf("correlation of binary tests: worst %.2f, rms %.3f\n", worst,
              std::sqrt(square / (kTestCount * (kTestCount - 1) / 2.0)));
  EXPECT_LT(worst, 0.75);
}

TEST(BriefPattern, CoverAllAngles) {
  const cv::Mat scene = testing::make_scene(64, 64, 1);
  const Describer describer;
  const Window window = sample_window(view_of(scene), 32, 32);
  const Descriptor at_pi = describer.describe(window, static_cast<float>(kPi));
  EXPECT_EQ(at_pi, describer.describe(window, static_cast<float>(-kPi)));
  for (double angle = -kPi; angle < kPi; angle += 0.01) {
    const Descriptor a = describer.describe(window, static_cast<float>(angle));
    EXPECT_LT(hamming(a, describer.describe(window, static_cast<float>(angle + 2 * kPi / Describer::kRotations))), 80);
  }
}

}  // namespace
}  // namespace bslam::feature
