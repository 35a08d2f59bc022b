// BundledMap::check_invariants: recomputes everything from scratch and compares.
#include <algorithm>
#include <map>
#include <set>

#include "map/bundled_map.h"

namespace bslam::map {
namespace {

using Broken = std::optional<std::string>;

std::string name(KeyframeId k) { return "keyframe " + std::to_string(k.value()); }
std::string name(LandmarkId l) { return "landmark " + std::to_string(l.value()); }
std::string name(FeatureId f) { return "feature " + std::to_string(f.value()); }

Broken check_reference(const BundledMap& map, LandmarkId l) {
  const LandmarkReference& reference = map.landmark(l).reference;
  for (const Observation& o : map.observations(l)) {
    if (o.keyframe != reference.keyframe) continue;
    const auto refs = map.keyframe(o.keyframe).frame->bundled.keypoints(o.feature);
    if (std::ranges::find(refs, reference.keypoint) != refs.end()) return {};
  }
  return name(l) + " has its reference in " + name(reference.keyframe) + ", which is not one of its observations";
}

// Checks the observations of one landmark against the landmark tables of the keyframes; adds the number of its
// keypoints to `keypoints`.
Broken check_landmark(const BundledMap& map, LandmarkId l, std::size_t& keypoints) {
  const auto list = map.observations(l);
  if (!map.landmark(l).alive) {
    if (!list.empty()) return name(l) + " is removed and has observations";
    return {};
  }
  if (map.merged_into(l).valid()) return name(l) + " is alive and merged";
  if (list.empty()) return name(l) + " is alive without observations";
  for (std::size_t i = 0; i < list.size(); ++i) {
    const KeyframeId k = list[i].keyframe;
    const FeatureId f = list[i].feature;
    if (!map.alive(k)) return name(l) + " is observed by removed " + name(k);
    if (i > 0 && list[i - 1].keyframe >= k) return name(l) + " has observations out of order or twice in " + name(k);
    if (map.landmark_of(k, f) != l)
      return name(l) + " is observed by " + name(f) + " of " + name(k) + ", whose table differs";
    keypoints += map.keyframe(k).frame->bundled.keypoints(f).size();
  }
  return check_reference(map, l);
}

Broken check_table(const BundledMap& map, KeyframeId k) {
  const BundledKeyframe& entry = map.keyframe(k);
  if (!entry.alive) {
    if (entry.frame || !entry.landmarks.empty() || !entry.covisible.empty() || !entry.children.empty()) {
      return name(k) + " is removed but still has a frame, landmarks, covisible keyframes or children";
    }
    return {};
  }
  if (!entry.frame) return name(k) + " has no frame";
  if (entry.landmarks.size() != entry.frame->bundled.size()) return name(k) + " has a table of the wrong size";
  for (std::size_t f = 0; f < entry.landmarks.size(); ++f) {
    const LandmarkId l = entry.landmarks[f];
    if (!l.valid()) continue;
    if (!map.alive(l)) return name(FeatureId(f)) + " of " + name(k) + " observes removed " + name(l);
    const auto list = map.observations(l);
    const auto at = std::ranges::find(list, k, &Observation::keyframe);
    if (at == list.end() || at->feature != FeatureId(f)) {
      return name(FeatureId(f)) + " of " + name(k) + " observes " + name(l) + ", whose observations differ";
    }
  }
  return {};
}

Broken check_covisibility(const BundledMap& map, KeyframeId k) {
  std::map<KeyframeId, int> weight;
  for (const LandmarkId l : map.keyframe(k).landmarks) {
    if (!l.valid()) continue;
    for (const Observation& o : map.observations(l)) {
      if (o.keyframe != k) ++weight[o.keyframe];
    }
  }
  auto expected = weight.begin();
  for (const Covisible& c : map.keyframe(k).covisible) {
    if (expected == weight.end() || expected->first != c.keyframe || expected->second != c.weight) {
      return name(k) + " has weight " + std::to_string(c.weight) + " with " + name(c.keyframe) +
             ", which is wrong or not in order of id";
    }
    ++expected;
  }
  if (expected != weight.end())
    return name(k) + " shares landmarks with " + name(expected->first) + " without a weight";
  return {};
}

// Checks that every keyframe is reachable from a root, which root_of() finds.
Broken check_tree(const BundledMap& map) {
  const std::vector<KeyframeId> ids = map.keyframe_ids();
  std::vector<KeyframeId> stack;
  for (const KeyframeId k : ids) {
    if (!map.keyframe(k).parent.valid()) stack.push_back(k);
  }
  std::set<KeyframeId> reached;
  while (!stack.empty()) {
    const KeyframeId k = stack.back();
    stack.pop_back();
    if (!reached.insert(k).second) return name(k) + " is reached twice in the spanning trees";
    const auto& children = map.keyframe(k).children;
    if (!std::ranges::is_sorted(children)) return name(k) + " has children out of order";
    for (const KeyframeId child : children) {
      if (!map.alive(child)) return name(k) + " has removed child " + name(child);
      if (map.keyframe(child).parent != k)
        return name(child) + " is a child of " + name(k) + " but has a different parent";
      stack.push_back(child);
    }
  }
  const std::vector<KeyframeId> root = map.root_of_each();
  for (const KeyframeId k : ids) {
    if (!reached.contains(k)) return name(k) + " is in no spanning tree";
    if (map.root_of(k) != root[k.index()]) return name(k) + " is in the submap of another root than is noted";
  }
  return {};
}

}  // namespace

std::optional<std::string> BundledMap::check_invariants() const {
  std::size_t keypoints = 0;
  for (std::size_t i = 0; i < landmarks_.size(); ++i) {
    if (Broken broken = check_landmark(*this, LandmarkId(i), keypoints)) return broken;
  }
  for (std::size_t i = 0; i < keyframes_.size(); ++i) {
    if (Broken broken = check_table(*this, KeyframeId(i))) return broken;
  }
  for (const KeyframeId k : keyframe_ids()) {
    if (Broken broken = check_covisibility(*this, k)) return broken;
  }
  if (keyframe_ids().size() != alive_keyframes_) return "the number of keyframes is wrong";
  if (landmark_ids().size() != alive_landmarks_) return "the number of landmarks is wrong";
  if (keypoints != observations_total_) return "the number of observations is wrong";
  return check_tree(*this);
}

}  // namespace bslam::map
