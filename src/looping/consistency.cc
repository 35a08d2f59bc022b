#include "looping/consistency.h"

#include <algorithm>

namespace bslam::looping {
namespace {

std::vector<KeyframeId> covisible_group(const map::BundledMap& map, KeyframeId k) {
  std::vector<KeyframeId> out = {k};
  for (const map::Covisible& c : map.keyframe(k).covisible) out.push_back(c.keyframe);
  std::sort(out.begin(), out.end());
  return out;
}

bool intersect(const std::vector<KeyframeId>& a, const std::vector<KeyframeId>& b) {
  for (auto i = a.begin(), j = b.begin(); i != a.end() && j != b.end();) {
    if (*i == *j) return true;
    *i < *j ? ++i : ++j;
  }
  return false;
}

}  // namespace

std::vector<PlaceCandidate> consistent_candidates(const map::BundledMap& map, KeyframeId keyframe,
                                                  const std::vector<PlaceCandidate>& candidates,
                                                  const LoopOptions& options, RecognitionHistory& history) {
  RecognitionHistory next;
  std::vector<PlaceCandidate> out;
  for (const PlaceCandidate& candidate : candidates) {
    RecognitionHistory::Place place{covisible_group(map, candidate.keyframe), 1, keyframe};
    for (const RecognitionHistory::Place& before : history.places) {
      if (keyframe.value() - before.last.value() <= options.max_keyframe_gap &&
          intersect(place.keyframes, before.keyframes)) {
        place.times = std::max(place.times, before.times + 1);
      }
    }
    if (place.times >= options.consistent_keyframes) out.push_back(candidate);
    next.places.push_back(std::move(place));
  }
  for (RecognitionHistory::Place& before : history.places) {
    const bool again =
        std::ranges::any_of(next.places, [&](const auto& p) { return intersect(p.keyframes, before.keyframes); });
    // The next keyframe has a larger id, so only places within a smaller gap than the maximum can be continued.
    if (!again && keyframe.value() - before.last.value() < options.max_keyframe_gap)
      next.places.push_back(std::move(before));
  }
  history = std::move(next);
  return out;
}

}  // namespace bslam::looping
