#include "feature/fast.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <opencv2/features2d.hpp>
#include <vector>

#include "base/random.h"
#include "synthetic_scene.h"

namespace bslam::feature {
namespace {

using testing::view_of;

cv::Mat noise_image(int width, int height, std::uint64_t seed, int levels = 256) {
  Random random(seed, "noise image");
  cv::Mat image(height, width, CV_8U);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      image.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(random.below(static_cast<std::uint32_t>(levels)) * 255 /
                                                               static_cast<std::uint32_t>(levels - 1));
    }
  }
  return image;
}

bool same(const Corner& a, const Corner& b) { return a.x == b.x && a.y == b.y && a.score == b.score; }

TEST(Fast, VectorAndScalarKernelsAreIdentical) {
  FastDetector fast, scalar(scalar_fast_kernels());
  std::vector<Corner> a, b;
  const cv::Mat scene = testing::make_scene(401, 203, 5);
  for (const int width : {401, 400, 50, 33, 20, 11}) {
    for (const cv::Mat& image :
         {scene, noise_image(401, 203, 3), noise_image(401, 203, 4, 2), noise_image(401, 203, 4, 4)}) {
      for (const int threshold : {0, 1, 5, 20, 100, 254}) {
        const cv::Mat part = image(cv::Rect(image.cols - width, 7, width, 150));
        fast.detect(view_of(part), 4, threshold, a);
        scalar.detect(view_of(part), 4, threshold, b);
        ASSERT_TRUE(std::equal(a.begin(), a.end(), b.begin(), b.end(), same)) << width << " " << threshold;
      }
    }
  }
}

TEST(Fast, VectorAndScalarKernelsForKindsAreIdentical) {
  const cv::Mat image = noise_image(64, 16, 8);
  std::vector<std::uint8_t> dark(64), bright(64), dark_scalar(64), bright_scalar(64), score(64);
  fast_kernels().kinds_row(image.ptr(8), 64, 3, 60, dark.data(), bright.data());
  scalar_fast_kernels().kinds_row(image.ptr(8), 64, 3, 60, dark_scalar.data(), bright_scalar.data());
  fast_kernels().score_row(image.ptr(8), 64, 3, 60, 0, score.data());
  EXPECT_EQ(dark, dark_scalar);
  EXPECT_EQ(bright, bright_scalar);
  for (std::size_t x = 3; x < 60; ++x) EXPECT_EQ(score[x], std::max(dark[x], bright[x]));
}

// OpenCV's response is the largest threshold at which the pixel is a corner; ours is one more.
TEST(Fast, AgreesWithOpenCv) {
  const cv::Mat image = noise_image(200, 150, 9);
  std::vector<cv::KeyPoint> theirs;
  cv::FAST(image, theirs, 30, false);
  std::vector<std::uint8_t> score(200);
  std::size_t corners = 0;
  for (int y = 3; y < 147; ++y) {
    fast_kernels().score_row(image.ptr(y), static_cast<std::ptrdiff_t>(image.step), 3, 197, 30, score.data());
    corners +=
        static_cast<std::size_t>(std::count_if(score.begin() + 3, score.begin() + 197, [](int s) { return s > 0; }));
  }
  EXPECT_EQ(corners, theirs.size());
  cv::FAST(image, theirs, 30, true);
  for (const cv::KeyPoint& k : theirs) {
    const int x = static_cast<int>(k.pt.x), y = static_cast<int>(k.pt.y);
    fast_kernels().score_row(image.ptr(y), static_cast<std::ptrdiff_t>(image.step), x, x + 1, 30, score.data());
    EXPECT_EQ(score[static_cast<std::size_t>(x)], static_cast<int>(k.response) + 1);
  }
}

TEST(Fast, KeepsOneCornerOfAPlateauInRowMajorOrder) {
  cv::Mat image(40, 60, CV_8U, cv::Scalar(100));
  for (const cv::Point p : {cv::Point(20, 12), cv::Point(21, 12), cv::Point(40, 25)}) image.at<std::uint8_t>(p) = 200;
  std::vector<Corner> corners;
  FastDetector().detect(view_of(image), 4, 20, corners);
  ASSERT_EQ(corners.size(), 2u);
  EXPECT_TRUE(same(corners[0], {20, 12, 100}));
  EXPECT_TRUE(same(corners[1], {40, 25, 100}));
}

TEST(Fast, FindsNothingInTinyOrBlankImages) {
  std::vector<Corner> corners{{1, 1, 1}};
  FastDetector detector;
  for (const cv::Size size : {cv::Size(1, 1), cv::Size(8, 8), cv::Size(9, 5), cv::Size(300, 200)}) {
    detector.detect(view_of(cv::Mat(size, CV_8U, cv::Scalar(255))), 4, 0, corners);
    EXPECT_TRUE(corners.empty());
  }
}

}  // namespace
}  // namespace bslam::feature
