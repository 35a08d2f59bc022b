// The one place where the map changes.
#pragma once

#include <memory>
#include <mutex>

#include "map/map_edit.h"
#include "map/rebase.h"

namespace bslam::map {

// What became of an edit: how it was applied, and the new version.
struct CommitReport : RebaseReport {
  MapSnapshot published;
  bool rebased = false;  // other edits had been committed since its base
  bool refused = false;  // a correction that another one overtook: nothing of it was applied, nothing published
};

// Versions it hands out are const and are never changed, nor is anything that could change them handed out: a draft works
// on its own copy. See cow_vector.h for why the memory they share is safe to read while drafts are written.
class MapStore {
 public:
  explicit MapStore(BundledMap initial);

  // The newest version; from any thread.
  MapSnapshot snapshot() const;

  // Leaves all behind and publishes `initial`. No draft of an earlier version may be committed afterwards.
  void restart(BundledMap initial);

  // Publishes the draft as the next version: its working copy as it is where its base is still the newest, with the
  // provisional ids as given; else its operations, applied to the newest by the rebase rules of map_edit.h. From any
  // thread; commits are one after the other.
  CommitReport commit(MapDraft draft);

 private:
  mutable std::mutex mutex_;   // guards current_
  std::mutex commit_mutex_;    // held by the writer
  MapSnapshot current_;
};

}  // namespace bslam::map
