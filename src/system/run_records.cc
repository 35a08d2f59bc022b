#include "system/run_records.h"

#include <utility>

namespace bslam::system {

void RunRecords::add_loop(const LoopRecord& loop) {
  const std::lock_guard lock(mutex_);
  loops_.push_back(loop);
}

void RunRecords::add_stage_run(const execution::StageRun& run) {
  const std::lock_guard lock(mutex_);
  stage_runs_.push_back({run, take_time(run.task)});
}

// Time of the frame that caused a task. A deferred frame is forgotten. Requires mutex_.
TimeNs RunRecords::take_time(const execution::StageTask& task) {
  if (task.stage != execution::Stage::kKeyframe) return keyframe_time_ns_[task.keyframe.index()];
  const TimeNs time_ns = deferred_time_ns_.at(task.frame);
  deferred_time_ns_.erase(task.frame);
  return time_ns;
}

void RunRecords::set_keyframe_time(KeyframeId k, TimeNs time_ns) {
  const std::lock_guard lock(mutex_);
  if (keyframe_time_ns_.size() <= k.index()) keyframe_time_ns_.resize(k.index() + 1);
  keyframe_time_ns_[k.index()] = time_ns;
}

void RunRecords::add_deferred(FrameId frame, TimeNs time_ns) {
  const std::lock_guard lock(mutex_);
  deferred_time_ns_[frame] = time_ns;
}

void RunRecords::add_created(const tracking::CreatedKeyframe& created, TimeNs time_ns) {
  set_keyframe_time(created.keyframe, time_ns);
  const std::lock_guard lock(mutex_);
  created_.push_back(created);
}

std::vector<tracking::CreatedKeyframe> RunRecords::take_created() {
  const std::lock_guard lock(mutex_);
  return std::exchange(created_, {});
}

bool RunRecords::creates_keyframes() const {
  const std::lock_guard lock(mutex_);
  return !deferred_time_ns_.empty() || !created_.empty();
}

void RunRecords::discard_map() {
  const std::lock_guard lock(mutex_);
  loops_.clear();
  created_.clear();
}

void RunRecords::keep_latest(std::size_t count) {
  const std::lock_guard lock(mutex_);
  if (stage_runs_.size() > count)
    stage_runs_.erase(stage_runs_.begin(), stage_runs_.end() - static_cast<std::ptrdiff_t>(count));
}

std::vector<StageRecord> RunRecords::stage_runs() const {
  const std::lock_guard lock(mutex_);
  return stage_runs_;
}

std::vector<LoopRecord> RunRecords::loops() const {
  const std::lock_guard lock(mutex_);
  return loops_;
}

TimeNs RunRecords::keyframe_time(KeyframeId k) const {
  const std::lock_guard lock(mutex_);
  // A keyframe is in the map a moment before it is recorded here.
  return k.index() < keyframe_time_ns_.size() ? keyframe_time_ns_[k.index()] : 0;
}

}  // namespace bslam::system
