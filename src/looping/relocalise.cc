#include "looping/relocalise.h"

#include <algorithm>

namespace bslam::looping {
namespace {

constexpr double kRival = 0.6;        // of the best one's inliers: as good an answer
constexpr double kSameCentre = 0.05;  // of the distance to what is seen
constexpr double kSameTurn = 0.05;    // rad

// Two answers in one part of the map that cannot both be true.
bool contradict(const map::BundledMap& map, const Location& a, const Location& b) {
  if (map.root_of(a.with) != map.root_of(b.with)) return false;
  const Eigen::Vector3d centre_a = a.T_rig_world.inverse().translation(), centre_b = b.T_rig_world.inverse().translation();
  double distance = 0;
  for (const auto& [feature, l] : a.matches) distance += (map.landmark(l).position - centre_a).norm();
  distance /= static_cast<double>(a.matches.size());
  const double turn = a.T_rig_world.rotation().angularDistance(b.T_rig_world.rotation());
  return (centre_a - centre_b).norm() > kSameCentre * distance || turn > kSameTurn;
}

}  // namespace

std::optional<Location> relocalise(PlaceRecogniser& recogniser, const map::BundledMap& map, const frame::BundledFrame& frame,
                                   const VerificationOptions& options, const map::FeatureModel& features, Random random) {
  std::vector<Location> found;
  for (const Candidate& candidate : recogniser.recognised(map, frame)) {
    if (auto location = locate(map, frame, candidate.keyframe, options, features, random)) found.push_back(std::move(*location));
  }
  if (found.empty()) return std::nullopt;
  // Of equal ones the first, which looks more alike.
  auto best = std::max_element(found.begin(), found.end(), [](const Location& a, const Location& b) { return a.inliers < b.inliers; });
  const bool disputed = std::any_of(found.begin(), found.end(), [&](const Location& other) {
    return other.inliers > kRival * best->inliers && contradict(map, *best, other);
  });
  if (disputed) return std::nullopt;
  return std::move(*best);
}

}  // namespace bslam::looping
