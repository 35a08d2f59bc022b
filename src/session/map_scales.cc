#include "session/map_scales.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "base/median.h"

namespace bslam::session {
namespace {

// For each landmark of the merged map, its id in one of the maps; invalid if it is not in that map.
std::vector<LandmarkId> origins(const map::BundledMap& merged, const MapPart& part) {
  std::vector<LandmarkId> out(merged.landmark_slots());
  for (const LandmarkId own : part.map->landmark_ids()) {
    const LandmarkId there = part.landmarks[own.index()];
    const LandmarkId now = there.valid() ? merged.resolve(there) : LandmarkId();
    if (now.valid()) out[now.index()] = own;
  }
  return out;
}

// A landmark in both maps.
using Twin = std::pair<Eigen::Vector3d, Eigen::Vector3d>;

// The ratio of distances between landmarks in the second map over those in the first; nullopt if there are too few.
std::optional<double> ratio_of(const std::vector<Twin>& twins) {
  constexpr std::size_t kMinTwins = 20;
  constexpr double kSmall = 1e-6;
  if (twins.size() < kMinTwins) return std::nullopt;
  std::vector<double> ratios;
  const std::size_t half = twins.size() / 2;
  for (std::size_t k = 0; k < half; ++k) {
    const auto& [a_first, a_second] = twins[k];
    const auto& [b_first, b_second] = twins[k + half];
    const double length = (a_first - b_first).norm();
    if (length > kSmall) ratios.push_back((a_second - b_second).norm() / length);
  }
  return ratios.empty() ? std::nullopt : std::optional(median(std::move(ratios)));
}

// One ratio for each keyframe of the second map that sees enough landmarks of the first one.
std::vector<double> ratios_of_views(const map::BundledMap& merged, const MapPart& first,
                                    const std::vector<LandmarkId>& of_first, const MapPart& second) {
  std::vector<double> ratios;
  for (const KeyframeId k : second.map->keyframe_ids()) {
    std::vector<Twin> twins;
    for (const LandmarkId own : second.map->keyframe(k).landmarks) {
      const LandmarkId there = own.valid() ? second.landmarks[own.index()] : LandmarkId();
      const LandmarkId now = there.valid() ? merged.resolve(there) : LandmarkId();
      const LandmarkId twin = now.valid() ? of_first[now.index()] : LandmarkId();
      if (twin.valid()) twins.emplace_back(first.map->landmark(twin).position, second.map->landmark(own).position);
    }
    if (const auto ratio = ratio_of(twins)) ratios.push_back(*ratio);
  }
  return ratios;
}

// Relative standard deviation of the median of the ratios, taking into account that neighbouring keyframes observe the
// same landmarks.
double deviation_of(const std::vector<double>& ratios, double middle) {
  constexpr double kNormal = 1.4826, kOfMedian = 1.2533, kNeighbours = 3, kLeast = 0.002;
  std::vector<double> away;
  for (const double ratio : ratios) away.push_back(std::abs(ratio - middle));
  const double independent = std::max(1.0, static_cast<double>(ratios.size()) / kNeighbours);
  return std::hypot(kLeast, kOfMedian * kNormal * median(std::move(away)) / middle / std::sqrt(independent));
}

}  // namespace

bool ScaleComparison::disagrees() const {
  constexpr double kSigmas = 3, kCalibrations = 0.01;
  return std::abs(std::log(ratio)) > std::max(kCalibrations, kSigmas * deviation);
}

std::vector<ScaleComparison> compare_scales(const map::BundledMap& merged, std::span<const MapPart> parts) {
  constexpr std::size_t kMinViews = 3;
  std::vector<ScaleComparison> out;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const std::vector<LandmarkId> of_first = origins(merged, parts[i]);
    for (std::size_t j = i + 1; j < parts.size(); ++j) {
      const std::vector<double> ratios = ratios_of_views(merged, parts[i], of_first, parts[j]);
      if (ratios.size() < kMinViews) continue;
      const double ratio = median(std::vector<double>(ratios));
      const double of_maps = std::hypot(parts[i].map->scale_deviation(), parts[j].map->scale_deviation());
      out.push_back({i, j, ratio, std::hypot(deviation_of(ratios, ratio), of_maps), static_cast<int>(ratios.size())});
    }
  }
  return out;
}

}  // namespace bslam::session
