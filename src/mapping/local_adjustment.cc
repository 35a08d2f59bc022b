#include "mapping/local_adjustment.h"

#include <algorithm>
#include <map>

namespace bslam::mapping {
namespace {

bool is_root(const map::BundledMap& map, KeyframeId k) { return !map.keyframe(k).parent.valid(); }

// Returns up to `limit` landmarks, those observed by the largest number of these keyframes, in order of id.
std::vector<LandmarkId> most_observed(const map::BundledMap& map, const std::vector<KeyframeId>& keyframes, int limit) {
  std::vector<int> count(map.landmark_slots(), 0);
  std::vector<LandmarkId> out;
  for (const KeyframeId k : keyframes) {
    for (const LandmarkId l : map.keyframe(k).landmarks) {
      if (l.valid() && count[l.index()]++ == 0) out.push_back(l);
    }
  }
  std::sort(out.begin(), out.end(), [&](LandmarkId a, LandmarkId b) {
    const int na = count[a.index()], nb = count[b.index()];
    return na != nb ? na > nb : a > b;
  });
  if (out.size() > static_cast<std::size_t>(limit)) out.resize(static_cast<std::size_t>(limit));
  std::sort(out.begin(), out.end());
  return out;
}

// Returns up to `limit` other keyframes, those that observe the largest number of these landmarks.
std::vector<KeyframeId> other_observers(const map::BundledMap& map, const std::vector<LandmarkId>& landmarks,
                                        const std::vector<KeyframeId>& window, int limit) {
  std::vector<int> count(map.keyframe_slots(), 0);
  for (const LandmarkId l : landmarks) {
    for (const map::Observation& o : map.observations(l)) ++count[o.keyframe.index()];
  }
  for (const KeyframeId k : window) count[k.index()] = 0;
  std::vector<KeyframeId> out;
  for (std::size_t k = 0; k < count.size(); ++k) {
    if (count[k] > 0) out.emplace_back(k);
  }
  std::sort(out.begin(), out.end(), [&](KeyframeId a, KeyframeId b) {
    const int na = count[a.index()], nb = count[b.index()];
    return na != nb ? na > nb : a < b;
  });
  if (out.size() > static_cast<std::size_t>(limit)) out.resize(static_cast<std::size_t>(limit));
  return out;
}

// Number of poses of a submap to fix so that its gauge is determined: two if the scale is arbitrary, otherwise one.
std::size_t num_fixed_poses(const map::BundledMap& map) { return map.scale() == map::Scale::kUpToScale ? 2 : 1; }

// Fixes the oldest free keyframes of each submap until enough of its poses are fixed, but not all keyframes; sorts both
// lists.
void fix_gauge(const map::BundledMap& map, adjustment::Selection& selection) {
  const std::vector<KeyframeId> root = map.root_of_each();
  std::map<KeyframeId, std::size_t> num_fixed;  // by root
  for (const KeyframeId k : selection.fixed_keyframes) ++num_fixed[root[k.index()]];
  std::sort(selection.free_keyframes.begin(), selection.free_keyframes.end());
  std::size_t num_free = selection.free_keyframes.size();
  std::erase_if(selection.free_keyframes, [&](KeyframeId k) {
    std::size_t& fixed = num_fixed[root[k.index()]];
    if (fixed >= num_fixed_poses(map) || num_free <= 1) return false;
    ++fixed;
    --num_free;
    selection.fixed_keyframes.push_back(k);
    return true;
  });
  std::sort(selection.fixed_keyframes.begin(), selection.fixed_keyframes.end());
}

}  // namespace

adjustment::Selection select_local(const map::BundledMap& map, KeyframeId keyframe, const LocalWindowOptions& options) {
  std::vector<KeyframeId> window = {keyframe};
  for (const map::Covisible& c : map.best_covisible(keyframe, static_cast<std::size_t>(options.free_keyframes - 1))) {
    window.push_back(c.keyframe);
  }
  adjustment::Selection selection;
  selection.landmarks = most_observed(map, window, options.max_landmarks);
  selection.fixed_keyframes = other_observers(map, selection.landmarks, window, options.fixed_keyframes);
  for (const KeyframeId k : window)
    (is_root(map, k) ? selection.fixed_keyframes : selection.free_keyframes).push_back(k);
  fix_gauge(map, selection);
  if (std::binary_search(selection.free_keyframes.begin(), selection.free_keyframes.end(), keyframe))
    selection.with_uncertainty = {keyframe};
  return selection;
}

bool needs_whole_submap(const map::BundledMap& map, KeyframeId keyframe, const ScaleOptions& options) {
  if (map.scale() != map::Scale::kUnobservable) return false;
  return map.keyframes_of_submap(map.root_of(keyframe)).size() <= static_cast<std::size_t>(options.keyframes);
}

adjustment::Selection select_submap(const map::BundledMap& map, KeyframeId keyframe) {
  adjustment::Selection selection;
  const KeyframeId root = map.root_of(keyframe);
  std::vector<KeyframeId> submap = map.keyframes_of_submap(root);
  std::sort(submap.begin(), submap.end());
  for (const KeyframeId k : submap) {
    if (k != root) selection.free_keyframes.push_back(k);
  }
  selection.fixed_keyframes = {root};
  selection.landmarks = most_observed(map, submap, static_cast<int>(map.landmark_slots()));
  return selection;
}

adjustment::Selection select_all(const map::BundledMap& map) {
  adjustment::Selection selection;
  for (const KeyframeId k : map.keyframe_ids()) {
    (is_root(map, k) ? selection.fixed_keyframes : selection.free_keyframes).push_back(k);
  }
  selection.landmarks = map.landmark_ids();
  selection.whole_map = true;
  fix_gauge(map, selection);
  if (map.scale() != map::Scale::kUnobservable) selection.with_uncertainty = selection.free_keyframes;
  return selection;
}

}  // namespace bslam::mapping
