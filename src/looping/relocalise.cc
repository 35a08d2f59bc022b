#include "looping/relocalise.h"

#include <algorithm>

namespace bslam::looping {
std::optional<Location> relocalise(PlaceRecogniser& recogniser, const map::BundledMap& map,
                                   const frame::BundledFrame& frame, const VerificationOptions& options,
                                   const map::FeatureModel& features, Random random) {
  std::vector<Location> found;
  const camera::Rig rig = frame::rig_of(map.rig(), frame);
  for (const Candidate& candidate : recogniser.recognised(map, frame)) {
    if (auto location = locate(map, rig, frame, candidate.keyframe, options, features, random))
      found.push_back(std::move(*location));
  }
  if (found.empty()) return std::nullopt;
  // Ties go to the first one, which scores higher in appearance.
  auto best = std::max_element(found.begin(), found.end(),
                               [](const Location& a, const Location& b) { return a.inliers < b.inliers; });
  const bool ambiguous =
      std::any_of(found.begin(), found.end(), [&](const Location& other) { return disputes(map, *best, other); });
  if (ambiguous) return std::nullopt;
  return std::move(*best);
}

}  // namespace bslam::looping
