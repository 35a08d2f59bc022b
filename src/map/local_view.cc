#include "map/local_view.h"

#include <algorithm>
#include <iterator>

#include "base/id_set.h"

namespace bslam::map {
namespace {

// The first occurrence of each id, in order.
std::vector<LandmarkId> each_once(std::span<const LandmarkId> ids) {
  std::vector<LandmarkId> out;
  IdSet<LandmarkId> listed(ids);
  for (const LandmarkId l : ids) {
    if (listed.insert(l)) out.push_back(l);
  }
  return out;
}

}  // namespace

std::vector<Covisible> observers(const BundledMap& map, std::span<const LandmarkId> landmarks) {
  std::vector<int> count(map.keyframe_slots(), 0);
  for (const LandmarkId l : landmarks) {
    for (const Observation& o : map.observations(l)) ++count[o.keyframe.index()];
  }
  std::vector<Covisible> out;
  for (std::size_t k = 0; k < count.size(); ++k) {
    if (count[k] > 0) out.push_back({KeyframeId(k), count[k]});
  }
  std::sort(out.begin(), out.end(), [](const Covisible& a, const Covisible& b) {
    return a.weight != b.weight ? a.weight > b.weight : a.keyframe > b.keyframe;
  });
  return out;
}

std::vector<LandmarkId> local_landmarks(const BundledMap& map, std::span<const LandmarkId> seeds, KeyframeId reference,
                                        const LocalViewOptions& options) {
  std::vector<KeyframeId> keyframes;  // most shared landmarks first
  const auto limit = static_cast<std::size_t>(options.max_keyframes);
  std::vector<std::uint8_t> taken(map.keyframe_slots(), 0);
  const auto take = [&](KeyframeId k) {
    if (keyframes.size() >= limit || !map.alive(k) || taken[k.index()]) return;
    taken[k.index()] = 1;
    keyframes.push_back(k);
  };
  take(reference);
  const std::vector<Covisible> ranked = observers(map, seeds);
  for (std::size_t i = 0; i < ranked.size() && keyframes.size() < (2 * limit) / 3; ++i) take(ranked[i].keyframe);
  const std::vector<KeyframeId> direct = keyframes;
  for (const KeyframeId k : direct) {
    for (const Covisible& c : map.best_covisible(k, static_cast<std::size_t>(options.neighbours))) take(c.keyframe);
  }

  std::vector<LandmarkId> observed(seeds.begin(), seeds.end());
  for (const KeyframeId k : keyframes) {
    std::ranges::copy_if(map.keyframe(k).landmarks, std::back_inserter(observed),
                         [](LandmarkId l) { return l.valid(); });
  }
  return each_once(observed);
}

}  // namespace bslam::map
