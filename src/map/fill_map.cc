// BundledMap::fill creates a map from the parts of a file. Links are checked and computed for all landmarks together,
// which is many times faster than adding landmarks one after the other.
#include <algorithm>
#include <numeric>
#include <utility>

#include "map/append_map.h"
#include "map/bundled_map.h"

namespace bslam::map {
namespace {

constexpr std::size_t kKeyframesPerTask = 64;

// The keyframes that share landmarks with `k`, in order of id. `weight` has a 0 for each keyframe, before and after.
std::vector<Covisible> neighbours_of(const BundledMap& map, KeyframeId k, std::span<const LandmarkId> table,
                                     std::vector<int>& weight) {
  std::vector<KeyframeId> found;
  for (const LandmarkId l : table) {
    if (!l.valid()) continue;
    for (const Observation& o : map.observations(l)) {
      if (o.keyframe != k && weight[o.keyframe.index()]++ == 0) found.push_back(o.keyframe);
    }
  }
  std::sort(found.begin(), found.end());
  std::vector<Covisible> out;
  out.reserve(found.size());
  for (const KeyframeId other : found) out.push_back({other, std::exchange(weight[other.index()], 0)});
  return out;
}

// Returns the problem of an observation of a landmark as `found` and `expected`.
std::optional<std::pair<const char*, const char*>> wrong(const MapParts& parts, std::size_t i, std::size_t first,
                                                         const std::vector<std::vector<LandmarkId>>& tables) {
  using Wrong = std::pair<const char*, const char*>;
  const KeyframeId k = parts.observing[i];
  const FeatureId f = parts.features[i];
  if (!k.valid() || k.index() >= tables.size())
    return Wrong{"observation by a keyframe that does not exist", "a keyframe of the map"};
  if (i > first && parts.observing[i - 1] >= k) return Wrong{"observations out of order", "increasing keyframe ids"};
  if (!f.valid() || f.index() >= tables[k.index()].size())
    return Wrong{"observation by a feature that does not exist", "a feature of the keyframe"};
  if (tables[k.index()][f.index()].valid()) return Wrong{"a feature of two landmarks", "one landmark per feature"};
  if (parts.aligned[i] > 1) return Wrong{"an invalid flag", "0 or 1 (the observation is aligned)"};
  return {};
}

}  // namespace

std::optional<PartsError> BundledMap::fill_landmarks(const MapParts& parts,
                                                     std::vector<std::vector<LandmarkId>>& tables) {
  const std::uint64_t tag = owner_.tag();
  std::vector<Observation> block;
  std::size_t at = 0;
  for (std::size_t l = 0; l < parts.counts.size(); ++l) {
    Landmark entry = parts.landmark(l);
    entry.alive = true;
    if (parts.counts[l] == 0) return PartsError{l, "no observation", "one or more observations"};
    if (!entry.born.valid() || entry.born.index() >= keyframes_.size())
      return PartsError{l, "a creating keyframe that does not exist", "a keyframe of the map"};
    const frame::KeypointRef r = entry.reference.keypoint;
    bool has_reference = false;
    const std::size_t first = at, end = at + parts.counts[l];
    for (; at < end; ++at) {
      if (const auto error = wrong(parts, at, first, tables)) return PartsError{l, error->first, error->second};
      const Observation o{parts.observing[at], parts.features[at], parts.aligned[at] == 1};
      tables[o.keyframe.index()][o.feature.index()] = LandmarkId(l);
      block.push_back(o);
      if (o.keyframe != entry.reference.keyframe) continue;
      const auto refs = keyframe(o.keyframe).frame->bundled.keypoints(o.feature);
      has_reference = std::ranges::find(refs, r) != refs.end();
    }
    if (!has_reference)
      return PartsError{l, "a reference that is not an observation", "an observation of the landmark"};
    landmarks_.push_back(entry, tag);
    merged_into_.push_back({}, tag);
    if ((l + 1) % ObservationColumn::kBlock == 0 || l + 1 == parts.counts.size()) {
      const std::size_t begin = l - l % ObservationColumn::kBlock;
      observations_.append(parts.counts.subspan(begin, l + 1 - begin), block, tag);
      block.clear();
    }
  }
  alive_landmarks_ = parts.counts.size();
  return {};
}

void BundledMap::fill_tables(std::vector<std::vector<LandmarkId>> tables, ThreadPool& pool) {
  std::vector<std::vector<Covisible>> covisible(tables.size());
  std::vector<std::size_t> keypoints(tables.size(), 0);
  pool.for_each((tables.size() + kKeyframesPerTask - 1) / kKeyframesPerTask, [&](std::size_t task) {
    std::vector<int> weight(tables.size(), 0);
    const std::size_t end = std::min((task + 1) * kKeyframesPerTask, tables.size());
    for (std::size_t k = task * kKeyframesPerTask; k < end; ++k) {
      covisible[k] = neighbours_of(*this, KeyframeId(k), tables[k], weight);
      for (std::size_t f = 0; f < tables[k].size(); ++f) {
        if (tables[k][f].valid()) keypoints[k] += num_keypoints({KeyframeId(k), FeatureId(f)});
      }
    }
  });
  const std::uint64_t tag = owner_.tag();
  for (std::size_t k = 0; k < tables.size(); ++k) {
    BundledKeyframe& entry = edit(KeyframeId(k));
    entry.landmarks = CowArray<LandmarkId>(std::move(tables[k]), tag);
    entry.covisible = CowArray<Covisible>(std::move(covisible[k]), tag);
  }
  observations_total_ = std::accumulate(keypoints.begin(), keypoints.end(), std::size_t{0});
}

std::optional<PartsError> BundledMap::fill(const MapParts& parts, ThreadPool& pool) {
  std::vector<std::vector<LandmarkId>> tables(parts.frames.size());
  for (std::size_t k = 0; k < parts.frames.size(); ++k) {
    BundledKeyframe entry;
    entry.frame = parts.frames[k];
    entry.twist = entry.frame->twist;
    entry.T_rig_world = parts.T_rig_world[k];
    entry.alive = true;
    keyframes_.push_back(std::move(entry), owner_.tag());
    tables[k].resize(parts.frames[k]->bundled.size());
  }
  alive_keyframes_ = parts.frames.size();
  next_keyframe_to_release_ = parts.frames.size();
  if (!attach_keyframes(*this, KeyframeId(0), parts.parents)) return PartsError{{}, "cyclic parents", "trees"};
  note_roots();
  if (auto error = fill_landmarks(parts, tables)) return error;
  fill_tables(std::move(tables), pool);
  return {};
}

}  // namespace bslam::map
