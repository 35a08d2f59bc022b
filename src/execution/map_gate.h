// The gate through which a run meets its map: reading and committing pass here, so that the journal tells both in an
// order that can be repeated.
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

  // The version a frame sees: the newest, or one given. Of the caller's thread.
  map::MapSnapshot begin_frame(FrameId frame);
  void begin_frame(FrameId frame, const map::MapSnapshot& seen);
  FrameId frame() const { return frame_; }  // begun last; of the caller's thread

  // Commits what the caller's thread did.
  map::CommitReport commit(JournalStep step, map::MapDraft draft);

  // What a background stage answered goes into the map, but not where a stop was requested before its turn came: then
  // it is as if the stage had never run. True where it was committed. From any thread.
  bool settle(const StageTask& task, MapVersion base, StageResult result, const std::stop_token& stop);

  // Leaves the map for another; versions go on counting.
  void restart(map::BundledMap initial);

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
