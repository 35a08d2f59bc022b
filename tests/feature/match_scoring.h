// Repeatability and matching scores of the features of two views under a known warp.
#pragma once

#include <algorithm>
#include <vector>

#include "feature/hamming.h"
#include "feature/keypoints.h"
#include "synthetic_scene.h"

namespace bslam::feature::testing {

struct Features {
  std::vector<cv::Point2d> points;
  std::vector<double> scale;  // level-0 pixels per pixel of the level
  std::vector<Descriptor> descriptors;
};

struct MatchScore {
  double repeatability = 0;  // fraction of the first view's common keypoints with a near one in the second view
  double precision = 0;      // fraction of correct mutual nearest matches
  double recall = 0;         // correct matches per common keypoint of the first view
  double error_px = 0;       // median distance of correct matches
  std::size_t right = 0;
};

// `warp` maps the first view to the second. Near means within `tolerance` pixels and 1.5 in scale.
inline MatchScore score_matches(const Features& a, const Features& b, const Similarity& warp, double tolerance = 3.0,
                                double margin = 60) {
  const auto near = [&](std::size_t i, std::size_t j) {
    const cv::Point2d d = warp(a.points[i]) - b.points[j];
    const double ratio = b.scale[j] / (a.scale[i] * warp.scale);
    return d.ddot(d) <= tolerance * tolerance && ratio < 1.5 && ratio > 1 / 1.5;
  };
  const auto nearest = [](const Descriptor& d, const std::vector<Descriptor>& all) {
    std::size_t best = 0;
    for (std::size_t j = 1; j < all.size(); ++j) {
      if (hamming(d, all[j]) < hamming(d, all[best])) best = j;
    }
    return best;
  };
  MatchScore score;
  std::size_t common = 0, repeated = 0, mutual = 0;
  std::vector<double> errors;
  for (std::size_t i = 0; i < a.points.size() && !b.points.empty(); ++i) {
    const cv::Point2d p = warp(a.points[i]);
    if (p.x < margin || p.y < margin || p.x > warp.size.width - 1 - margin || p.y > warp.size.height - 1 - margin)
      continue;
    ++common;
    bool found = false;
    for (std::size_t j = 0; j < b.points.size() && !found; ++j) found = near(i, j);
    repeated += found;
    const std::size_t j = nearest(a.descriptors[i], b.descriptors);
    if (nearest(b.descriptors[j], a.descriptors) != i) continue;
    ++mutual;
    if (!near(i, j)) continue;
    ++score.right;
    const cv::Point2d d = p - b.points[j];
    errors.push_back(std::sqrt(d.ddot(d)));
  }
  if (common > 0) score.repeatability = static_cast<double>(repeated) / static_cast<double>(common);
  if (common > 0) score.recall = static_cast<double>(score.right) / static_cast<double>(common);
  if (mutual > 0) score.precision = static_cast<double>(score.right) / static_cast<double>(mutual);
  if (errors.empty()) return score;
  std::nth_element(errors.begin(), errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2), errors.end());
  score.error_px = errors[errors.size() / 2];
  return score;
}

}  // namespace bslam::feature::testing
