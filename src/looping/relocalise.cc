#include "looping/relocalise.h"

#include <algorithm>

namespace bslam::looping {
std::optional<PlaceMatch> relocalise(PlaceRecogniser& recogniser, const map::BundledMap& map,
                                     const frame::BundledFrame& frame,
                                     const std::function<bool(const PlaceMatch&)>& plausible,
                                     const VerificationOptions& options, const feature::FeatureModel& features,
                                     Random random) {
  std::vector<PlaceMatch> found;
  const camera::Rig rig = frame::rig_of(map.rig(), frame);
  for (const PlaceCandidate& candidate : recogniser.query_frame(map, frame)) {
    auto place_match = verify_place(map, rig, frame, candidate.keyframe, options, features, random);
    if (place_match && plausible(*place_match)) found.push_back(std::move(*place_match));
  }
  if (found.empty()) return std::nullopt;
  // On ties the first one is used, which has the higher appearance score.
  auto best = std::max_element(found.begin(), found.end(),
                               [](const PlaceMatch& a, const PlaceMatch& b) { return a.inliers < b.inliers; });
  const bool ambiguous =
      std::any_of(found.begin(), found.end(), [&](const PlaceMatch& other) { return contradicts(map, *best, other); });
  if (ambiguous) return std::nullopt;
  return std::move(*best);
}

}  // namespace bslam::looping
