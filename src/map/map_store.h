// The one place where the map changes.
#pragma once

#include <memory>
#include <mutex>

#include "map/map_edit.h"

namespace bslam::map {

// What became of an edit.
struct CommitReport {
  MapSnapshot published;        // the new version
  bool rebased = false;         // other edits had been committed since its base
  std::size_t applied = 0;      // operations
  std::size_t dropped = 0;      // operations whose objects were gone
  // Ids given to what the edit added, in order of the operations; invalid where dropped.
  std::vector<KeyframeId> keyframes;
  std::vector<LandmarkId> landmarks;
};

class MapStore {
 public:
  explicit MapStore(BundledMap initial);

  // The newest version; from any thread.
  MapSnapshot snapshot() const;

  // Applies the draft, by the rebase rules of map_edit.h where its base is no longer the newest, and publishes the next
  // version. From any thread; commits are one after the other.
  CommitReport commit(MapDraft draft);

 private:
  mutable std::mutex mutex_;   // guards current_
  std::mutex commit_mutex_;    // held by the writer
  MapSnapshot current_;
};

}  // namespace bslam::map
