#include "session/merge_maps.h"

#include <memory>

#include "looping/loop_closer.h"
#include "map/append_map.h"
#include "map/map_store.h"
#include "mapping/map_keyframe.h"

namespace bslam::session {

Result<MergeResult> merge_maps(const storage::SavedMap& a, const storage::SavedMap& b,
                               const place::VocabularyPtr& vocabulary, const system::Config& config) {
  feature::FeatureModel features = config.feature_model();
  features.pyramid = a.map.pyramid();
  for (const storage::SavedMap* saved : {&a, &b}) {
    if (saved->map.scale() != map::Scale::kMetric)
      return Error{saved->file, "scale", "a map without metric scale",
                   "a metric map, since only metric maps can be merged"};
    if (const Status s = storage::fits(*saved, a.map.rig(), a.map.pyramid(), vocabulary.get()); !s) return s.error();
  }
  map::BundledMap both = a.map;
  map::BundledMap other = b.map;
  other.set_rig(both.shared_rig());
  const map::AppendedIds ids = map::append_map(both, other);
  map::MapStore store(std::move(both));
  MergeResult result{.map = a.map};
  looping::LoopCloser closer(std::make_unique<looping::BagOfWordsRecogniser>(vocabulary, config.looping.recognition),
                             config.looping, features, static_cast<std::uint64_t>(config.seed));
  for (const KeyframeId k : ids.keyframes) {
    if (!store.snapshot()->alive(k)) continue;
    map::MapDraft draft(store.snapshot());
    const auto closure = closer.close(k, draft);
    if (!closure) continue;
    store.commit(std::move(draft));
    ++(closure->merged ? result.joined : result.loops);
  }
  map::MapDraft draft(store.snapshot());
  mapping::adjust_globally(config.mapping, features, draft);
  store.commit(std::move(draft));
  result.map = *store.snapshot();
  result.submaps = result.map.roots().size();
  return result;
}

}  // namespace bslam::session
