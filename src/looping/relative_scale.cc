#include "looping/relative_scale.h"

#include <algorithm>
#include <vector>

#include "base/median.h"

namespace bslam::looping {
namespace {

constexpr std::size_t kMinPairs = 10;

}  // namespace

std::optional<double> relative_scale(const map::BundledMap& map, KeyframeId keyframe, const PlaceMatch& place_match) {
  if (map.scale() == map::Scale::kMetric) return 1.0;
  std::vector<double> ratios;
  for (const auto& [feature, there] : place_match.matches) {
    const LandmarkId here = map.landmark_of(keyframe, feature);
    if (!here.valid()) continue;
    const double distance_here = (map.keyframe(keyframe).T_rig_world * map.landmark(here).position).norm();
    ratios.push_back((place_match.T_rig_world * map.landmark(there).position).norm() / distance_here);
  }
  if (ratios.size() < kMinPairs) return std::nullopt;
  return median(std::move(ratios));
}

}  // namespace bslam::looping
