#include "mapping/fuse_landmarks.h"

#include <algorithm>

#include "map/keyframe_landmarks.h"

namespace bslam::mapping {
namespace {

std::vector<KeyframeId> fusion_targets(const map::BundledMap& map, KeyframeId keyframe, const FusionOptions& options) {
  std::vector<KeyframeId> targets;
  const auto add = [&](KeyframeId k) {
    if (k == keyframe || targets.size() >= static_cast<std::size_t>(options.max_targets)) return;
    if (std::find(targets.begin(), targets.end(), k) == targets.end()) targets.push_back(k);
  };
  const auto neighbours = map.best_covisible(keyframe, static_cast<std::size_t>(options.neighbours));
  for (const map::Covisible& c : neighbours) add(c.keyframe);
  for (const map::Covisible& c : neighbours) {
    for (const map::Covisible& d :
         map.best_covisible(c.keyframe, static_cast<std::size_t>(options.second_neighbours))) {
      add(d.keyframe);
    }
  }
  return targets;
}

}  // namespace

void fuse_landmarks(KeyframeId keyframe, const FusionOptions& options, const FeatureModel& features,
                    map::MapDraft& draft) {
  const std::vector<KeyframeId> targets = fusion_targets(draft.map(), keyframe, options);
  for (const KeyframeId target : targets) {
    fuse_into(target, landmarks_of(draft.map(), keyframe), Keep::kMoreObserved, options.search, features, draft);
  }
  std::vector<LandmarkId> neighbour_landmarks;
  for (const KeyframeId target : targets) {
    const std::vector<LandmarkId> landmarks = landmarks_of(draft.map(), target);
    neighbour_landmarks.insert(neighbour_landmarks.end(), landmarks.begin(), landmarks.end());
  }
  std::sort(neighbour_landmarks.begin(), neighbour_landmarks.end());
  neighbour_landmarks.erase(std::unique(neighbour_landmarks.begin(), neighbour_landmarks.end()),
                            neighbour_landmarks.end());
  fuse_into(keyframe, neighbour_landmarks, Keep::kMoreObserved, options.search, features, draft);
  draft.refresh_landmarks(landmarks_of(draft.map(), keyframe));
}

}  // namespace bslam::mapping
