#include "feature/extractor.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <set>
#include <tuple>
#include <vector>

#include "feature/window.h"
#include "synthetic_scene.h"

namespace bslam::feature {
namespace {

using testing::pinhole_camera;
using testing::render;
using testing::Similarity;
using testing::view_of;

const cv::Size kSize(752, 480);

cv::Mat test_view(double gain = 1, double noise = 2) {
  static const cv::Mat scene = testing::make_scene(1700, 1100, 21);
  return render(scene, {0, 1, 0, 0, kSize}, 0, gain, 0, noise);
}

Detections extract(const cv::Mat& image, const FeatureOptions& options = {}, const cv::Mat& mask = {}) {
  Extractor extractor(options);
  image::Pyramid pyramid;
  Detections keypoints;
  extractor.extract(view_of(image), mask.empty() ? image::ImageView{} : view_of(mask), pinhole_camera(image.size()),
                    pyramid, keypoints);
  return keypoints;
}

void expect_equal(const Detections& a, const Detections& b) {
  EXPECT_EQ(a.pixel, b.pixel);
  EXPECT_EQ(a.level, b.level);
  EXPECT_EQ(a.angle, b.angle);
  EXPECT_EQ(a.sigma, b.sigma);
  EXPECT_EQ(a.bearing, b.bearing);
  EXPECT_EQ(a.descriptor, b.descriptor);
  EXPECT_EQ(a.patch, b.patch);
}

TEST(Extractor, FillsAllFieldsOfTheDetections) {
  const cv::Mat image = test_view();
  FeatureOptions options;
  Extractor extractor(options);
  image::Pyramid pyramid;
  Detections k;
  const camera::Camera camera = pinhole_camera(image.size());
  extractor.extract(view_of(image), {}, camera, pyramid, k);
  ASSERT_EQ(k.size(), 1200u);
  for (std::size_t i = 0; i < k.size(); ++i) {
    const std::size_t level = k.level[i];
    ASSERT_LT(level, pyramid.size());
    EXPECT_FLOAT_EQ(k.sigma[i], static_cast<float>(FeatureOptions().sigma_px *
                                                   std::sqrt(pyramid.scale_x[level] * pyramid.scale_y[level])));
    const auto pixel = camera.project(3.0 * k.bearing[i]);
    ASSERT_TRUE(pixel.has_value());
    EXPECT_LT((*pixel - k.pixel[i].cast<double>()).norm(), 1e-3);
    EXPECT_NEAR(k.bearing[i].norm(), 1.0, 1e-12);
    const Patch patch =
        sample_patch(pyramid.levels[level].view(), static_cast<float>(pyramid.from_base_x(level, k.pixel[i].x())),
                     static_cast<float>(pyramid.from_base_y(level, k.pixel[i].y())));
    for (std::size_t s = 0; s < patch.size(); ++s)
      EXPECT_NEAR(patch[s], k.patch[i][s], 3);  // float rounding of the pixel
  }
  EXPECT_TRUE(std::is_sorted(k.level.begin(), k.level.end()));
}

TEST(Extractor, IsDeterministic) {
  const cv::Mat image = test_view(), other = test_view(0.4);
  const Detections first = extract(image);
  Extractor extractor{FeatureOptions{}};
  image::Pyramid pyramid;
  Detections k;
  for (const cv::Mat& m : {other, image, cv::Mat(other(cv::Rect(0, 0, 333, 211))), image}) {
    extractor.extract(view_of(m), {}, pinhole_camera(m.size()), pyramid, k);
  }
  expect_equal(first, k);
}

TEST(Extractor, AcceptsStridedViewsOfAnyWidth) {
  const cv::Mat image = test_view();
  for (const int width : {331, 338, 345, 352}) {
    const cv::Mat part = image(cv::Rect(13, 9, width, 207));
    expect_equal(extract(part), extract(part.clone()));
  }
}

TEST(Extractor, ReturnsAboutTheWantedNumber) {
  const cv::Mat image = test_view();
  for (const int wanted : {50, 300, 1200, 2000}) {
    FeatureOptions options;
    options.per_image = wanted;
    const std::size_t count = extract(image, options).size();
    EXPECT_LE(count, static_cast<std::size_t>(wanted));
    EXPECT_GE(count, static_cast<std::size_t>(wanted) * 95 / 100);
  }
}

// Number of cells of a 12 x 8 grid with keypoints, and the maximum number of keypoints in one of them.
std::pair<std::size_t, std::size_t> occupancy(const Detections& k) {
  std::vector<std::size_t> count(96, 0);
  for (const Eigen::Vector2f& p : k.pixel) {
    ++count[static_cast<std::size_t>(p.y() / 60) * 12 + static_cast<std::size_t>(p.x() / 62.7f)];
  }
  return {96 - static_cast<std::size_t>(std::count(count.begin(), count.end(), 0u)),
          *std::max_element(count.begin(), count.end())};
}

TEST(Extractor, BudgetEqualsTheOption) {
  const cv::Mat image = test_view();
  const auto with = [](int per_image) {
    FeatureOptions options;
    options.per_image = per_image;
    return options;
  };
  Extractor extractor{FeatureOptions{}};
  image::Pyramid pyramid;
  Detections k;
  const int usual = FeatureOptions{}.per_image;
  for (const auto& [budget, wanted] :
       {std::pair(std::optional(450), 450), {9000, 2 * usual}, {std::nullopt, usual}, {450, 450}}) {
    extractor.extract(view_of(image), {}, pinhole_camera(image.size()), pyramid, k, budget);
    expect_equal(k, extract(image, with(wanted)));
  }
  extractor.extract(view_of(image), {}, pinhole_camera(image.size()), pyramid, k, 0);
  EXPECT_EQ(k.size(), 0u);
  EXPECT_EQ(pyramid.size(), static_cast<std::size_t>(FeatureOptions{}.levels));
}

TEST(Extractor, SpreadsOverTheImage) {
  const auto [filled, most] = occupancy(extract(test_view()));
  std::printf("grid of 12 x 8: %zu cells filled, at most %zu of 1200 keypoints in one\n", filled, most);
  EXPECT_GE(filled, 94u);
  EXPECT_LE(most, 50u);  // 12.5 on average
}

TEST(Extractor, TexturedRegionDoesNotTakeAll) {
  cv::Mat image = test_view(0.25);
  const cv::Mat strong = test_view();
  strong(cv::Rect(0, 0, 250, 160)).copyTo(image(cv::Rect(0, 0, 250, 160)));
  const Detections k = extract(image);
  const auto inside =
      std::count_if(k.pixel.begin(), k.pixel.end(), [](const auto& p) { return p.x() < 250 && p.y() < 160; });
  EXPECT_EQ(k.size(), 1200u);
  EXPECT_LT(inside, 400);  // a ninth of the area
}

TEST(Extractor, AdaptsToDarkImages) {
  const cv::Mat dark = test_view(0.12, 1);  // no contrast above 28
  const Detections k = extract(dark);
  FeatureOptions fixed;
  fixed.fast_threshold_min = fixed.fast_threshold;
  const auto [filled, most] = occupancy(k);
  std::printf("dark image: %zu keypoints, with the upper threshold alone %zu\n", k.size(), extract(dark, fixed).size());
  EXPECT_GT(k.size(), 1000u);
  EXPECT_GE(filled, 90u);
  EXPECT_LT(extract(dark, fixed).size(), k.size() / 4);
}

TEST(Extractor, IgnoresMaskedPixelsAndPixelsWithoutBearing) {
  const cv::Mat image = test_view();
  cv::Mat mask(image.size(), CV_8U, cv::Scalar(255));
  mask(cv::Rect(200, 100, 300, 250)) = 0;
  const Detections k = extract(image, {}, mask);
  EXPECT_GT(k.size(), 1100u);  // masked keypoints are replaced by others
  for (const Eigen::Vector2f& p : k.pixel) {
    EXPECT_NE(mask.at<std::uint8_t>(static_cast<int>(std::lround(p.y())), static_cast<int>(std::lround(p.x()))), 0);
  }
  // Strong barrel distortion: only pixels near the middle have a bearing.
  camera::Camera camera = pinhole_camera(image.size());
  camera.model = camera::PinholeRadTan({450, 450, 375.5, 239.5}, {-0.9, 0.0, 0.0, 0.0});
  Extractor extractor{FeatureOptions{}};
  image::Pyramid pyramid;
  Detections seen;
  extractor.extract(view_of(image), {}, camera, pyramid, seen);
  EXPECT_LT(seen.size(), 1000u);
  EXPECT_GT(seen.size(), 100u);
  for (const Eigen::Vector2f& p : seen.pixel) EXPECT_TRUE(camera.unproject(p.cast<double>()).has_value());
}

TEST(Extractor, AcceptsAnyImage) {
  for (const cv::Size size :
       {cv::Size(1, 1), cv::Size(5, 300), cv::Size(40, 30), cv::Size(37, 37), cv::Size(38, 45), cv::Size(64, 48)}) {
    EXPECT_TRUE(extract(cv::Mat(size, CV_8U, cv::Scalar(0))).empty());
    EXPECT_TRUE(extract(cv::Mat(size, CV_8U, cv::Scalar(255))).empty());
    cv::Mat noise(size, CV_8U);
    Random random(3);
    for (int y = 0; y < size.height; ++y) {
      for (int x = 0; x < size.width; ++x) noise.at<std::uint8_t>(y, x) = random.below(2) != 0 ? 255 : 0;
    }
    EXPECT_LE(extract(noise).size(), 1200u);
  }
  EXPECT_TRUE(extract(cv::Mat(kSize, CV_8U, cv::Scalar(90))).empty());
  EXPECT_TRUE(extract(cv::Mat()).empty());
  FeatureOptions extreme;
  extreme.per_image = 20000;
  extreme.levels = 16;
  extreme.scale_factor = 2.0;
  extreme.fast_threshold_min = 1;
  const Detections k = extract(test_view(0.1, 20), extreme);
  EXPECT_GT(k.size(), 5000u);
  EXPECT_LE(k.size(), 20000u);
}

}  // namespace
}  // namespace bslam::feature
