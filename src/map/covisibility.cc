// The covisibility graph and the spanning trees of a map.
#include <algorithm>

#include "map/bundled_map.h"

namespace bslam::map {
namespace {

// Orders neighbours by decreasing weight, newer first on ties.
bool better(const Covisible& a, const Covisible& b) {
  return a.weight != b.weight ? a.weight > b.weight : a.keyframe > b.keyframe;
}

}  // namespace

std::vector<Covisible> BundledMap::best_covisible(KeyframeId k, std::size_t limit, int min_weight) const {
  std::vector<Covisible> best;
  for (const Covisible& c : keyframe(k).covisible) {
    if (c.weight >= min_weight) best.push_back(c);
  }
  const std::size_t count = std::min(limit, best.size());
  std::partial_sort(best.begin(), best.begin() + static_cast<std::ptrdiff_t>(count), best.end(), better);
  best.resize(count);
  return best;
}

void BundledMap::change_weight(KeyframeId a, KeyframeId b, int change) {
  change_half_weight(a, b, change);
  change_half_weight(b, a, change);
}

void BundledMap::change_half_weight(KeyframeId at, KeyframeId neighbour, int change) {
  std::vector<Covisible>& list = edit(at).covisible.mutate(owner_.tag());
  const auto entry = std::ranges::lower_bound(list, neighbour, {}, &Covisible::keyframe);
  if (entry == list.end() || entry->keyframe != neighbour) {
    list.insert(entry, {neighbour, change});
  } else if ((entry->weight += change) == 0) {
    list.erase(entry);
  }
}

void BundledMap::connect_new_keyframe(KeyframeId k) {
  std::vector<int> weight(k.index(), 0);  // number of shared landmarks per older keyframe
  for (const LandmarkId l : keyframe(k).landmarks) {
    if (!l.valid()) continue;
    for (const Observation& o : observations(l)) {
      if (o.keyframe != k) ++weight[o.keyframe.index()];
    }
  }
  std::vector<Covisible> list;
  for (std::size_t i = 0; i < weight.size(); ++i) {
    if (weight[i] == 0) continue;
    list.push_back({KeyframeId(i), weight[i]});
    edit(KeyframeId(i)).covisible.mutate(owner_.tag()).push_back({k, weight[i]});  // the newest id comes last
  }
  edit(k).covisible = CowArray<Covisible>(std::move(list), owner_.tag());
}

KeyframeId BundledMap::choose_parent(KeyframeId k, KeyframeId fallback) const {
  const auto& list = keyframe(k).covisible;
  if (list.empty()) return fallback;
  return std::min_element(list.begin(), list.end(), better)->keyframe;
}

void BundledMap::attach(KeyframeId child, KeyframeId parent) {
  edit(child).parent = parent;
  std::vector<KeyframeId>& children = edit(parent).children;
  children.insert(std::ranges::lower_bound(children, child), child);
}

// Reverses the parent links on the path from `k` to the root.
void BundledMap::make_root(KeyframeId k) {
  KeyframeId child = k, parent = keyframe(k).parent;
  edit(k).parent = KeyframeId();
  while (parent.valid()) {
    const KeyframeId next = keyframe(parent).parent;
    std::erase(edit(parent).children, child);
    attach(parent, child);
    child = parent;
    parent = next;
  }
}

// The children are attached one at a time to the parent of the removed keyframe or to a child attached before, always
// the one with the largest covisibility weight first, so no cycle can form. Children without covisible keyframes among
// these are attached to the parent.
void BundledMap::reassign_children(KeyframeId removed) {
  const KeyframeId parent = keyframe(removed).parent;
  std::erase(edit(parent).children, removed);
  std::vector<KeyframeId> waiting = std::exchange(edit(removed).children, {});
  std::vector<KeyframeId> attached = {parent};  // in order of id
  while (!waiting.empty()) {
    KeyframeId child = waiting.front();
    Covisible best{parent, 0};
    for (const KeyframeId candidate : waiting) {
      for (const Covisible& link : keyframe(candidate).covisible) {
        if (!std::ranges::binary_search(attached, link.keyframe)) continue;
        if (link.weight > best.weight || (link.weight == best.weight && candidate == child && better(link, best))) {
          best = link;
          child = candidate;
        }
      }
    }
    attach(child, best.keyframe);
    std::erase(waiting, child);
    attached.insert(std::ranges::lower_bound(attached, child), child);
  }
}

KeyframeId BundledMap::root_of(KeyframeId k) const {
  for (; keyframe(k).parent.valid(); k = keyframe(k).parent) {
    if (const KnownRoot& known = keyframe(k).root; known.id.valid() && known.num_merges == num_merges_) return known.id;
  }
  return k;
}

std::vector<KeyframeId> BundledMap::root_of_each() const {
  std::vector<KeyframeId> out(keyframes_.size());
  std::vector<KeyframeId> path;  // from a keyframe to one whose root is known
  for (std::size_t i = 0; i < keyframes_.size(); ++i) {
    KeyframeId k(i);
    for (path.clear(); !out[k.index()].valid() && keyframe(k).parent.valid(); k = keyframe(k).parent) path.push_back(k);
    const KeyframeId root = out[k.index()].valid() ? out[k.index()] : k;
    out[k.index()] = root;
    for (const KeyframeId passed : path) out[passed.index()] = root;
  }
  return out;
}

void BundledMap::note_roots() {
  const std::vector<KeyframeId> roots = root_of_each();
  for (std::size_t i = 0; i < roots.size(); ++i) edit(KeyframeId(i)).root = {roots[i], num_merges_};
}

}  // namespace bslam::map
