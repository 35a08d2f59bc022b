#include "mapping/fuse_landmarks.h"

#include <algorithm>

namespace bslam::mapping {
namespace {

std::vector<KeyframeId> fusion_targets(const map::BundledMap& map, KeyframeId keyframe, const FusionOptions& options) {
  std::vector<KeyframeId> targets;
  const auto take = [&](KeyframeId k) {
    if (k == keyframe || targets.size() >= static_cast<std::size_t>(options.max_targets)) return;
    if (std::find(targets.begin(), targets.end(), k) == targets.end()) targets.push_back(k);
  };
  const auto first = map.best_covisible(keyframe, static_cast<std::size_t>(options.neighbours));
  for (const map::Covisible& c : first) take(c.keyframe);
  for (const map::Covisible& c : first) {
    for (const map::Covisible& d :
         map.best_covisible(c.keyframe, static_cast<std::size_t>(options.second_neighbours))) {
      take(d.keyframe);
    }
  }
  return targets;
}

}  // namespace

FusionReport fuse_landmarks(KeyframeId keyframe, const FusionOptions& options, const FeatureModel& features,
                            map::MapDraft& draft) {
  using mapping::Keep;
  FusionReport report;
  const std::vector<KeyframeId> targets = fusion_targets(draft.map(), keyframe, options);
  for (const KeyframeId target : targets) {
    report += mapping::fuse_into(target, mapping::landmarks_of(draft.map(), keyframe), Keep::kMoreObserved,
                                 options.search, features, draft);
  }
  std::vector<LandmarkId> theirs;
  for (const KeyframeId target : targets) {
    const std::vector<LandmarkId> some = mapping::landmarks_of(draft.map(), target);
    theirs.insert(theirs.end(), some.begin(), some.end());
  }
  std::sort(theirs.begin(), theirs.end());
  theirs.erase(std::unique(theirs.begin(), theirs.end()), theirs.end());
  report += mapping::fuse_into(keyframe, theirs, Keep::kMoreObserved, options.search, features, draft);
  draft.refresh_landmarks(mapping::landmarks_of(draft.map(), keyframe));
  return report;
}

}  // namespace bslam::mapping
