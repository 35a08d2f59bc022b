#include "execution/map_gate.h"

namespace bslam::execution {

MapGate::MapGate(map::MapStore& store, bool keep_journal)
    : store_(store), keep_journal_(keep_journal), newest_(store.snapshot()) {}

map::MapSnapshot MapGate::newest() const {
  const std::lock_guard lock(mutex_);
  return newest_;
}

map::MapSnapshot MapGate::begin_frame(FrameId frame) {
  frame_ = frame;
  const std::lock_guard lock(mutex_);
  if (keep_journal_) journal_.entries.push_back({JournalStep::kFrame, frame.value(), newest_->version(), std::nullopt});
  return newest_;
}

void MapGate::begin_frame(FrameId frame, const map::MapSnapshot& seen) {
  frame_ = frame;
  append({JournalStep::kFrame, frame.value(), seen->version(), std::nullopt});
}

void MapGate::note_reduction(int level) {
  const std::lock_guard lock(mutex_);
  if (keep_journal_) journal_.entries.push_back({JournalStep::kReduce, level, newest_->version(), std::nullopt});
}

map::CommitReport MapGate::commit(JournalStep step, map::MapDraft draft) {
  const std::lock_guard order(order_);
  return publish(step, frame_.value(), std::move(draft));
}

CommitOutcome MapGate::commit_stage(StageTask& task, MapVersion base, StageResult result, const std::stop_token& stop) {
  const std::lock_guard order(order_);
  if (stop.stop_requested()) return CommitOutcome::kStopped;
  if (!result.draft) {
    append({journal_step(task.stage), task.input(), base, std::nullopt});
    return CommitOutcome::kUnchanged;
  }
  BSLAM_ASSERT(result.draft->map().version() == base, "a stage's draft must be based on the version passed to it");
  const map::CommitReport report = publish(journal_step(task.stage), task.input(), std::move(*result.draft));
  if (report.rejected) return CommitOutcome::kRejected;
  if (task.stage == Stage::kKeyframe) task.keyframe = report.keyframes.front();
  if (result.committed) result.committed(report);
  return CommitOutcome::kCommitted;
}

void MapGate::restart() {
  const std::lock_guard order(order_);
  const MapVersion base = newest()->version();
  store_.restart();
  map::MapSnapshot fresh = store_.snapshot();
  const MapVersion version = fresh->version();
  append({JournalStep::kRestart, frame_.value(), base, version}, std::move(fresh));
}

Journal MapGate::journal() const {
  const std::lock_guard lock(mutex_);
  return journal_;
}

map::CommitReport MapGate::publish(JournalStep step, std::int32_t input, map::MapDraft draft) {
  const MapVersion base = draft.map().version();  // a draft has the version of its base
  map::CommitReport report = store_.commit(std::move(draft));
  if (report.rejected) {
    append({step, input, base, std::nullopt});
  } else {
    append({step, input, base, report.published->version()}, report.published);
  }
  return report;
}

void MapGate::append(const JournalEntry& entry, map::MapSnapshot newest) {
  const std::lock_guard lock(mutex_);
  if (keep_journal_) journal_.entries.push_back(entry);
  if (newest) newest_.swap(newest);  // the old version is destroyed with the argument, after the lock
}

}  // namespace bslam::execution
