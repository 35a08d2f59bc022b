// The only place where the map is modified.
#pragma once

#include <memory>
#include <mutex>

#include "map/map_edit.h"
#include "map/rebase.h"

namespace bslam::map {

// How an edit was applied, and the resulting version.
struct CommitReport : RebaseReport {
  MapSnapshot published;
  bool rebased = false;  // other edits had been committed since the base
  // The edit corrects poses, and another correction has been committed since its base. Nothing was applied or
  // published.
  bool rejected = false;
};

// Published versions are const and never modified: a draft works on its own copy. cow_vector.h explains why memory
// shared with drafts can be read safely while they are written.
class MapStore {
 public:
  explicit MapStore(BundledMap initial);

  // Returns the newest version. Thread-safe.
  MapSnapshot snapshot() const;

  // Publishes a version from which all keyframes and landmarks are removed; their ids are not used again. Drafts of
  // earlier versions must not be committed afterwards.
  void restart();

  // Publishes the draft as the next version. If its base is still the newest version, its working copy is published
  // unchanged, and provisional ids become final; otherwise its operations are applied to the newest version by the
  // rebase rules of map_edit.h. Thread-safe; commits are serialised.
  CommitReport commit(MapDraft draft);

 private:
  mutable std::mutex mutex_;  // guards current_
  std::mutex commit_mutex_;   // held by the writer
  MapSnapshot current_;
};

}  // namespace bslam::map
