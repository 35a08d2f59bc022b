#include "map/local_view.h"

#include <algorithm>

namespace bslam::map {
namespace {

// Keyframes by the number of seeds they observe, falling; ties: newer first.
std::vector<Covisible> vote(const BundledMap& map, std::span<const LandmarkId> seeds) {
  std::vector<int> votes(map.keyframe_slots(), 0);
  for (const LandmarkId l : seeds) {
    for (const Observation& o : map.observations(l)) ++votes[o.keyframe.index()];
  }
  std::vector<Covisible> ranked;
  for (std::size_t k = 0; k < votes.size(); ++k) {
    if (votes[k] > 0) ranked.push_back({KeyframeId(k), votes[k]});
  }
  std::sort(ranked.begin(), ranked.end(), [](const Covisible& a, const Covisible& b) {
    return a.weight != b.weight ? a.weight > b.weight : a.keyframe > b.keyframe;
  });
  return ranked;
}

}  // namespace

LocalView make_local_view(const BundledMap& map, std::span<const LandmarkId> seeds, KeyframeId reference,
                          const LocalViewOptions& options) {
  LocalView view;
  const auto limit = static_cast<std::size_t>(options.max_keyframes);
  std::vector<std::uint8_t> taken(map.keyframe_slots(), 0);
  const auto take = [&](KeyframeId k) {
    if (view.keyframes.size() >= limit || !map.alive(k) || taken[k.index()]) return;
    taken[k.index()] = 1;
    view.keyframes.push_back(k);
  };
  take(reference);
  const std::vector<Covisible> ranked = vote(map, seeds);
  for (std::size_t i = 0; i < ranked.size() && view.keyframes.size() < (2 * limit) / 3; ++i) take(ranked[i].keyframe);
  const std::vector<KeyframeId> direct = view.keyframes;
  for (const KeyframeId k : direct) {
    for (const Covisible& c : map.best_covisible(k, static_cast<std::size_t>(options.neighbours))) take(c.keyframe);
  }

  std::vector<std::uint8_t> listed(map.landmark_slots(), 0);
  const auto list = [&](LandmarkId l) {
    if (!l.valid() || listed[l.index()]) return;
    listed[l.index()] = 1;
    view.landmarks.push_back(l);
  };
  for (const LandmarkId l : seeds) list(l);
  for (const KeyframeId k : view.keyframes) {
    for (const LandmarkId l : map.keyframe(k).landmarks) list(l);
  }
  return view;
}

}  // namespace bslam::map
