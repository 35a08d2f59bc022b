// Serialises snapshot reads and commits of the map, and records them in a journal that can be replayed.
#pragma once

#include <mutex>

#include "execution/journal.h"
#include "map/map_store.h"

namespace bslam::execution {

class MapGate {
 public:
  // `store` must outlive the gate, and all commits must go through the gate. Without a journal, journal() is empty and
  // uses no memory.
  explicit MapGate(map::MapStore& store, bool keep_journal = true);

  // The newest version recorded in the journal. Thread-safe; does not wait for a running commit.
  map::MapSnapshot newest() const;

  // Begins a frame that uses the newest version, which is returned, or the version `seen`. Caller's thread only.
  map::MapSnapshot begin_frame(FrameId frame);
  void begin_frame(FrameId frame, const map::MapSnapshot& seen);
  FrameId frame() const { return frame_; }  // the last frame begun; caller's thread only

  // Records a change of the level of reduced work. Caller's thread only.
  void note_reduction(int level);

  // Commits an edit of the caller's thread.
  map::CommitReport commit(JournalStep step, map::MapDraft draft);

  // Commits the result of a background stage. A task of kKeyframe gets the id of the new keyframe. If a stop was
  // requested before, the result is discarded as if the stage had never run. Thread-safe.
  CommitOutcome commit_stage(StageTask& task, MapVersion base, StageResult result, const std::stop_token& stop);

  // Empties the map; version numbers and ids continue.
  void restart();

  // The journal so far. Thread-safe.
  Journal journal() const;

 private:
  map::CommitReport publish(JournalStep step, std::int32_t input, map::MapDraft draft);
  void append(const JournalEntry& entry, map::MapSnapshot newest = nullptr);

  map::MapStore& store_;
  const bool keep_journal_;
  std::mutex order_;  // held from the decision to commit until the journal contains the commit
  FrameId frame_;     // used by the caller's thread only
  mutable std::mutex mutex_;
  map::MapSnapshot newest_;  // guarded by mutex_, as journal_; both change together
  Journal journal_;
};

}  // namespace bslam::execution
