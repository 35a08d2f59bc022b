#include "session/merge_maps.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <tuple>
#include <unordered_map>
#include <utility>

#include "base/assert.h"
#include "base/interrupted.h"
#include "looping/loop_closer.h"
#include "map/append_map.h"
#include "map/map_store.h"
#include "mapping/map_keyframe.h"
#include "session/keyframe_identity.h"
#include "storage/map_sections.h"

namespace bslam::session {
namespace {

using storage::SavedMap;

// The feature model with the pyramid of the map, which may differ from that of the settings.
feature::FeatureModel features_of(const map::BundledMap& map, const system::Config& config) {
  feature::FeatureModel features = config.feature_model();
  features.pyramid = map.pyramid();
  return features;
}

bool before(const SavedMap& a, const SavedMap& b) {
  return std::tuple(b.map.num_keyframes(), a.checksums) < std::tuple(a.map.num_keyframes(), b.checksums);
}

// Checks that no keyframe is in two maps.
Status check_keyframes(const std::vector<SavedMap>& maps) {
  std::unordered_map<std::uint64_t, std::size_t> map_of;
  for (std::size_t i = 0; i < maps.size(); ++i) {
    std::vector<std::size_t> shared(i);  // with each earlier map
    for (const KeyframeId k : maps[i].map.keyframe_ids()) {
      const std::size_t first = map_of.try_emplace(identity_of(maps[i].map.keyframe(k)), i).first->second;
      if (first < i) ++shared[first];
    }
    for (std::size_t j = 0; j < i; ++j) {
      if (shared[j] == 0) continue;
      return Error{maps[i].file, "keyframes",
                   fmt::format("{} of {} in {} as well", shared[j], maps[i].map.num_keyframes(), maps[j].file),
                   "maps without common keyframes, which would be in the merged map twice"};
    }
  }
  return {};
}

// `maps` are sorted.
Status check(const std::vector<SavedMap>& maps, const place::Vocabulary& vocabulary) {
  for (std::size_t i = 0; i < maps.size(); ++i) {
    const SavedMap& saved = maps[i];
    if (saved.map.scale() != map::Scale::kMetric)
      return Error{saved.file, "scale", "a map without metric scale",
                   "a metric map, since only metric maps can be merged"};
    if (saved.map.num_keyframes() == 0) return Error{saved.file, "keyframes", "none", "a map with keyframes"};
    if (maps.size() > 1 && saved.info.vocabulary == 0)
      return Error{saved.file, "vocabulary", "none", "a map with visual words, in which places can be recognised"};
    if (i > 0 && saved.checksums == maps[i - 1].checksums)
      return Error{saved.file, "", "the same map as " + maps[i - 1].file, "different maps"};
    if (Status s = storage::fits(saved, maps.front().map.pyramid(), &vocabulary); !s) return s;
  }
  return check_keyframes(maps);
}

std::string reason_of(const looping::JoinAttempts& attempts, const looping::LoopingOptions& options) {
  switch (attempts.farthest) {
    case looping::JoinStage::kNoCandidate:
      return "no place looks like one of the other maps";
    case looping::JoinStage::kNotConsistent:
      return fmt::format("no place was recognised by {} successive keyframes", options.loop.consistent_keyframes);
    case looping::JoinStage::kNotVerified:
      return fmt::format("places look alike, but their geometry does not agree ({} inliers, {} are needed)",
                         attempts.most_inliers, options.verification.min_inliers);
    case looping::JoinStage::kAmbiguous:
      return "the same place fits several places of the other maps";
  }
  return {};
}

struct Inputs {
  map::BundledMap map;                             // the map of all inputs
  std::vector<std::vector<KeyframeId>> keyframes;  // keyframes of each input
  std::vector<MapPart> parts;                      // each
};

Result<Inputs> append_all(const std::vector<SavedMap>& maps) {
  std::vector<LandmarkId> same;
  for (std::size_t l = 0; l < maps.front().map.landmark_slots(); ++l) same.emplace_back(l);
  Inputs out{maps.front().map, {maps.front().map.keyframe_ids()}, {{&maps.front().map, std::move(same)}}};
  for (std::size_t i = 1; i < maps.size(); ++i) {
    map::AppendedIds ids = map::append_map(out.map, maps[i].map);
    std::erase_if(ids.keyframes, [](KeyframeId k) { return !k.valid(); });
    out.keyframes.push_back(std::move(ids.keyframes));
    out.parts.push_back({&maps[i].map, std::move(ids.landmarks)});
    if (out.map.rig().size() > storage::kMaxCameras)
      return Error{maps[i].file, "rig", fmt::format("{} cameras with those of the other maps", out.map.rig().size()),
                   fmt::format("at most {}; maps with fewer rigs", storage::kMaxCameras)};
  }
  return out;
}

// The smallest of the most frequent values.
std::size_t most_frequent(const std::vector<std::size_t>& values) {
  std::map<std::size_t, int> count;
  for (const std::size_t value : values) ++count[value];
  return std::ranges::max_element(count, {}, [](const auto& entry) { return entry.second; })->first;
}

// For each input, the position among the roots of the submap with most of its keyframes.
std::vector<std::size_t> submaps_of_inputs(const map::BundledMap& map,
                                           const std::vector<std::vector<KeyframeId>>& inputs) {
  const std::vector<KeyframeId> roots = map.roots(), root_of_each = map.root_of_each();
  std::vector<std::size_t> out;
  for (const std::vector<KeyframeId>& keyframes : inputs) {
    std::vector<std::size_t> submaps;
    for (const KeyframeId k : keyframes)
      submaps.push_back(
          static_cast<std::size_t>(std::ranges::lower_bound(roots, root_of_each[k.index()]) - roots.begin()));
    out.push_back(most_frequent(submaps));
  }
  return out;
}

// Returns true if the first input is not in the submap of most inputs, or no other input is in its submap.
bool is_apart(const map::BundledMap& map, const std::vector<std::vector<KeyframeId>>& inputs) {
  const std::vector<std::size_t> submaps = submaps_of_inputs(map, inputs);
  return submaps.size() > 1 &&
         (std::ranges::count(submaps, submaps.front()) == 1 || submaps.front() != most_frequent(submaps));
}

// Searches loop closures for the keyframes of a map, which has been appended, and commits them, until a stop request.
looping::JoinAttempts join(const std::vector<KeyframeId>& keyframes, looping::LoopCloser& closer, map::MapStore& store,
                           MergeResult& result, const std::stop_token& interrupted) {
  looping::JoinAttempts attempts;
  closer.begin_path();
  for (const KeyframeId k : keyframes) {
    if (interrupted.stop_requested()) break;
    map::MapDraft draft(store.snapshot());
    const auto closure = closer.close(k, draft, &attempts);
    if (!closure) continue;
    store.commit(std::move(draft));
    closer.committed(*closure);
    ++(closure->merged ? result.joined : result.loops);
  }
  return attempts;
}

}  // namespace

Result<MergeResult> merge_maps(std::vector<SavedMap> maps, const place::VocabularyPtr& vocabulary,
                               const system::Config& config, const std::stop_token& interrupted) {
  std::ranges::sort(maps, before);
  if (Status s = check(maps, *vocabulary); !s) return s.error();
  const feature::FeatureModel features = features_of(maps.front().map, config);
  auto inputs = append_all(maps);
  if (!inputs) return inputs.error();
  map::MapStore store(std::move(inputs->map));
  MergeResult result{maps.front().map, {}};
  looping::LoopCloser closer(std::make_unique<looping::BagOfWordsRecogniser>(vocabulary, config.looping.recognition),
                             config.looping, features, static_cast<std::uint64_t>(config.seed));
  // The first map is the one in which the others are searched; it is searched in them if it has remained apart.
  std::vector<looping::JoinAttempts> attempts(maps.size());
  for (std::size_t i = 1; i < maps.size(); ++i)
    attempts[i] = join(inputs->keyframes[i], closer, store, result, interrupted);
  if (is_apart(*store.snapshot(), inputs->keyframes))
    attempts[0] = join(inputs->keyframes[0], closer, store, result, interrupted);
  if (Status s = not_interrupted(interrupted); !s) return s.error();
  result.map = *store.snapshot();
  BSLAM_ASSERT(result.map.num_keyframes() == result.map.keyframe_slots(), "merging must not remove keyframes");
  const std::vector<std::size_t> submaps = submaps_of_inputs(result.map, inputs->keyframes);
  const std::size_t largest = most_frequent(submaps);
  for (std::size_t i = 0; i < maps.size(); ++i) {
    const bool joined = submaps[i] == largest;
    result.inputs.push_back({maps[i].file, maps[i].info.data, inputs->keyframes[i].size(), submaps[i],
                             joined ? "" : reason_of(attempts[i], config.looping), maps[i].info.warning});
  }
  result.vocabulary = maps.front().info.vocabulary;
  result.scales = compare_scales(result.map, inputs->parts);
  return result;
}

std::vector<std::string> warnings_of(const MergeResult& merged, std::string MergedInput::*name) {
  std::vector<std::string> out;
  for (const MergedInput& input : merged.inputs) {
    if (input.warning.empty()) continue;
    const bool of_several = input.data.find(kBetweenRecordings) != std::string::npos;
    const bool names_itself = of_several && name == &MergedInput::data;
    out.push_back(names_itself ? input.warning : input.*name + ": " + input.warning);
  }
  for (const ScaleComparison& c : merged.scales) {
    if (!c.disagrees()) continue;
    out.push_back(
        fmt::format("the scales of {} and {} disagree: lengths are {:.2f} % {} in the second (std {:.2f} %); no map "
                    "was scaled, so the merged map is distorted: check the baselines of both calibrations",
                    merged.inputs[c.first].*name, merged.inputs[c.second].*name, 100 * std::abs(c.ratio - 1),
                    c.ratio > 1 ? "longer" : "shorter", 100 * c.deviation));
  }
  return out;
}

void adjust_merged(map::BundledMap& map, const system::Config& config, const std::stop_token& interrupted) {
  const feature::FeatureModel features = features_of(map, config);
  map::MapStore store(std::move(map));
  map::MapDraft draft(store.snapshot());
  mapping::adjust_globally(config.mapping, features, draft, interrupted);
  store.commit(std::move(draft));
  map = *store.snapshot();
}

}  // namespace bslam::session
