#include "map/map_store.h"

namespace bslam::map {
namespace {

constexpr std::size_t kSlotsPerCommit = 1024;   // number of landmark slots checked for memory to release
constexpr std::size_t kKeyframesPerCommit = 4;  // number of keyframes whose unused memory is released at most

}  // namespace

MapStore::MapStore(BundledMap initial) : current_(std::make_shared<const BundledMap>(std::move(initial))) {}

MapSnapshot MapStore::snapshot() const {
  const std::lock_guard lock(mutex_);
  return current_;
}

void MapStore::restart() {
  const std::lock_guard writer(commit_mutex_);
  BundledMap emptied = *snapshot();
  for (const KeyframeId root : emptied.roots()) emptied.remove_submap(root);
  emptied.free_removed(emptied.landmark_slots());
  if (emptied.rig_deviation())  // estimated from the map that was wrong
    emptied.set_rig(std::make_shared<const camera::Rig>(emptied.given_rig()), nullptr);
  emptied.set_scale(Scale::kMetric);  // the initial value of a new map
  emptied.set_version(emptied.version().next());
  auto fresh = std::make_shared<const BundledMap>(std::move(emptied));
  const std::lock_guard lock(mutex_);
  current_.swap(fresh);
}

CommitReport MapStore::commit(MapDraft draft) {
  const std::lock_guard writer(commit_mutex_);
  MapSnapshot current = snapshot();
  if (draft.superseded(*current)) {
    CommitReport rejected;
    rejected.rejected = true;
    rejected.published = std::move(current);
    return rejected;
  }
  auto [edit, result] = std::move(draft).finish();
  CommitReport report;
  report.rebased = edit.base != current;
  if (report.rebased) {
    result = *current;
    static_cast<RebaseReport&>(report) = rebase(edit, result);
  } else {
    report.applied = edit.operations.size();
    for (std::size_t k = current->keyframe_slots(); k < result.keyframe_slots(); ++k) report.keyframes.emplace_back(k);
    for (std::size_t l = current->landmark_slots(); l < result.landmark_slots(); ++l) report.landmarks.emplace_back(l);
  }
  result.free_removed(kSlotsPerCommit);
  result.release_unused(kKeyframesPerCommit);
  result.set_version(current->version().next());
  report.published = std::make_shared<const BundledMap>(std::move(result));
  {
    const std::lock_guard lock(mutex_);
    current_ = report.published;
  }
  // The previous version in `current` is destroyed here, after the mutex of the readers was released.
  return report;
}

}  // namespace bslam::map
