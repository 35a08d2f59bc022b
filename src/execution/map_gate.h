// Serialises snapshot reads and commits of the map, and journals them in an order that a replay can repeat.
#pragma once

#include <mutex>

#include "execution/journal.h"
#include "map/map_store.h"

namespace bslam::execution {

class MapGate {
 public:
  // `store` outlives the gate; nobody else commits to it. Without a journal, journal() stays empty and takes no memory.
  explicit MapGate(map::MapStore& store, bool keep_journal = true);

  // The newest version the journal knows of. From any thread, never waiting for a commit under way.
  map::MapSnapshot newest() const;

  // Begins a frame and returns the version it sees: the newest, or the one given. Caller's thread only.
  map::MapSnapshot begin_frame(FrameId frame);
  void begin_frame(FrameId frame, const map::MapSnapshot& seen);
  FrameId frame() const { return frame_; }  // begun last; caller's thread only

  // Commits an edit of the caller's thread.
  map::CommitReport commit(JournalStep step, map::MapDraft draft);

  // Commits the result of a background stage. If a stop was requested before its turn comes, the result is discarded as
  // if the stage had never run. Returns whether it was committed. From any thread.
  bool settle(const StageTask& task, MapVersion base, StageResult result, const std::stop_token& stop);

  // Empties the map; version numbers and ids continue.
  void restart();

  // What was done so far; from any thread.
  Journal journal() const;

 private:
  map::CommitReport publish(JournalStep step, std::int32_t input, map::MapDraft draft);
  void append(const JournalEntry& entry, map::MapSnapshot newest = nullptr);

  map::MapStore& store_;
  const bool keep_journal_;
  std::mutex order_;  // held from the decision to commit until the journal has it
  FrameId frame_;     // of the caller's thread
  mutable std::mutex mutex_;
  map::MapSnapshot newest_;  // guarded by mutex_, as the one below: both change together
  Journal journal_;
};

}  // namespace bslam::execution
