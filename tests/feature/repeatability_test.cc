// Comparison with cv::ORB with the same number of features, on views of one scene under known warps.
#include <gtest/gtest.h>

#include <cstdio>
#include <cstring>
#include <opencv2/features2d.hpp>

#include "feature/extractor.h"
#include "match_scoring.h"

namespace bslam::feature {
namespace {

using namespace testing;  // NOLINT: the fixtures of this folder

constexpr int kFeatures = 800;

Features ours(const cv::Mat& view) {
  FeatureOptions options;
  options.per_image = kFeatures;
  Extractor extractor(options);
  image::Pyramid pyramid;
  Detections k;
  extractor.extract(view_of(view), {}, pinhole_camera(view.size()), pyramid, k);
  Features features;
  for (std::size_t i = 0; i < k.size(); ++i) {
    features.points.emplace_back(k.pixel[i].x(), k.pixel[i].y());
    features.scale.push_back(pyramid.scale_x[k.level[i]]);
  }
  features.descriptors = k.descriptor;
  return features;
}

Features open_cv(const cv::Mat& view) {
  std::vector<cv::KeyPoint> k;
  cv::Mat rows;
  cv::ORB::create(kFeatures)->detectAndCompute(view, {}, k, rows);
  Features features;
  for (std::size_t i = 0; i < k.size(); ++i) {
    features.points.emplace_back(k[i].pt);
    features.scale.push_back(std::pow(1.2, k[i].octave));
    Descriptor descriptor;
    std::memcpy(descriptor.data(), rows.ptr(static_cast<int>(i)), sizeof(descriptor));
    features.descriptors.push_back(descriptor);
  }
  return features;
}

struct View {
  const char* name;
  double angle, scale, blur, gain, offset, noise;
};

constexpr View kViews[] = {{"shift", 0, 1, 0, 1, 0, 2},
                           {"rotation 10 deg", 0.17, 1, 0, 1, 0, 2},
                           {"rotation 45 deg", 0.785, 1, 0, 1, 0, 2},
                           {"rotation 137 deg", 2.4, 1, 0, 1, 0, 2},
                           {"scale 0.7", 0, 0.7, 0, 1, 0, 2},
                           {"scale 0.85", 0.1, 0.85, 0, 1, 0, 2},
                           {"scale 1.15", 0.1, 1.15, 0, 1, 0, 2},
                           {"scale 1.4", 0, 1.4, 0, 1, 0, 2},
                           {"blur 1.5 px", 0, 1, 1.5, 1, 0, 2},
                           {"dark, gain 0.3", 0, 1, 0, 0.3, 5, 2},
                           {"bright, gain 1.4", 0, 1, 0, 1.4, 20, 2},
                           {"noise 8", 0, 1, 0, 1, 0, 8}};

void add(MatchScore& sum, const MatchScore& score) {
  const double part = 1.0 / static_cast<double>(std::size(kViews));
  sum.repeatability += part * score.repeatability;
  sum.precision += part * score.precision;
  sum.recall += part * score.recall;
  sum.error_px += part * score.error_px;
}

void print(const char* name, const MatchScore& a, const MatchScore& b) {
  std::printf("%-17s %5.3f %5.3f %5.3f %5.2f px | %5.3f %5.3f %5.3f %5.2f px\n", name, a.repeatability, a.precision,
              a.recall, a.error_px, b.repeatability, b.precision, b.recall, b.error_px);
}

TEST(Extractor, MatchesAtLeastAsWellAsOpenCvOrb) {
  const cv::Mat scene = make_scene(1800, 1200, 3);
  const cv::Size size(640, 440);
  const cv::Mat first = render(scene, {0, 1, 0, 0, size}, 0, 1, 0, 2, 7);
  const Features our_first = ours(first), cv_first = open_cv(first);
  MatchScore our_mean, cv_mean;
  std::printf("repeatability, precision, recall, error:  bslam | cv::ORB\n");
  for (const View& v : kViews) {
    const Similarity warp{v.angle, v.scale, 3.3, 1.7, size};
    const cv::Mat second = render(scene, warp, v.blur, v.gain, v.offset, v.noise, 11);
    const MatchScore a = score_matches(our_first, ours(second), warp);
    const MatchScore b = score_matches(cv_first, open_cv(second), warp);
    print(v.name, a, b);
    EXPECT_GT(a.precision, b.precision - 0.05) << v.name;
    EXPECT_GT(a.repeatability, b.repeatability - 0.15)
        << v.name;  // keypoints of cv::ORB cluster, which increases its value
    EXPECT_LT(a.error_px, b.error_px) << v.name;
    add(our_mean, a);
    add(cv_mean, b);
  }
  print("mean", our_mean, cv_mean);
  EXPECT_GT(our_mean.repeatability, cv_mean.repeatability - 0.05);
  EXPECT_GT(our_mean.precision, cv_mean.precision);
  EXPECT_GT(our_mean.recall, cv_mean.recall);
  EXPECT_LT(our_mean.error_px, 0.5 * cv_mean.error_px);
}

}  // namespace
}  // namespace bslam::feature
