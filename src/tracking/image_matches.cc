#include "tracking/image_matches.h"

#include <cmath>
#include <cstdlib>

namespace bslam::tracking {

std::vector<feature::DescriptorMatch> match_images(const feature::Keypoints& a, const feature::Keypoints& b) {
  constexpr int kMaxHamming = 50;  // bits of 256; stricter than with a prediction
  constexpr double kRatio = 0.8;
  constexpr double kWindow = 0.25;  // rad
  const double min_cosine = std::cos(kWindow);
  const auto in_window = [&](std::size_t i, std::size_t j) {
    return std::abs(a.level[i] - b.level[j]) <= 1 && a.bearing[i].dot(b.bearing[j]) >= min_cosine;
  };
  return feature::mutual_matches(a.descriptor, b.descriptor, kMaxHamming, kRatio, in_window);
}

}  // namespace bslam::tracking
