#include <algorithm>
#include <array>
#include <deque>
#include <map>

#include "execution/schedules.h"

namespace bslam::execution {
namespace {

class ReplayExecutor : public StageExecutor {
 public:
  ReplayExecutor(Journal journal, MapGate& gate, ExecutionSetup setup)
      : journal_(std::move(journal)), gate_(gate), setup_(std::move(setup)) {
    for (std::size_t i = 0; i < journal_.entries.size(); ++i) last_use_[journal_.entries[i].base] = i;
    keep(gate_.newest());
  }

  map::MapSnapshot begin_frame(FrameId frame, TimeNs) override {
    run_background();
    if (interrupted()) return gate_.begin_frame(frame);
    expect(JournalStep::kFrame, frame.value());
    const map::MapSnapshot seen = recorded_base();
    gate_.begin_frame(frame, seen);
    advance();
    return seen;
  }

  map::CommitReport commit(JournalStep step, map::MapDraft draft) override {
    run_background();
    if (interrupted()) return gate_.commit(step, std::move(draft));
    expect(step, gate_.frame().value(), draft.map().version());
    if (step == JournalStep::kFinal) expect_nothing_waits();
    const map::CommitReport report = gate_.commit(step, std::move(draft));
    keep(report.published);
    advance();
    return report;
  }

  void note_reduction(int level) override {
    run_background();
    if (interrupted()) return;
    expect(JournalStep::kReduce, level);
    gate_.note_reduction(level);
    advance();
  }

  void enqueue(const StageTask& task) override { waiting(task.stage).push_back(task); }

  void drain() override { run_background(); }

  void restart() override {
    run_background();
    if (interrupted()) return gate_.restart();
    expect(JournalStep::kRestart, gate_.frame().value(), gate_.newest()->version());
    for (auto& tasks : waiting_) tasks.clear();
    gate_.restart();
    keep(gate_.newest());
    advance();
  }

  void end() override {
    if (!over()) fail("the end");
  }

  void interrupt() override { stop_.request_stop(); }
  bool over() const override { return interrupted() || at_end(); }

 private:
  bool interrupted() const { return stop_.stop_requested(); }
  bool at_end() const { return next_ == journal_.entries.size(); }
  const JournalEntry& entry() const { return journal_.entries[next_]; }
  std::deque<StageTask>& waiting(Stage stage) { return waiting_[static_cast<std::size_t>(stage)]; }

  [[noreturn]] void fail(const std::string& this_run) const {
    throw ReplayMismatch({journal_.name, "entry " + std::to_string(next_), at_end() ? "the end" : entry_text(entry()),
                          this_run + ", as this run does"});
  }

  // Throws if the call of the caller's thread differs from the current entry.
  void expect(JournalStep step, std::int32_t input, std::optional<MapVersion> base = std::nullopt) const {
    const bool fits = !at_end() && entry().step == step && entry().input == input && (!base || entry().base == *base);
    if (!fits) fail(step_text(step, input) + (base ? " on version " + std::to_string(base->value()) : ""));
  }

  void expect_nothing_waits() const {
    for (const Stage stage : kStages) {
      const auto& tasks = waiting_[static_cast<std::size_t>(stage)];
      if (!tasks.empty() && !can_be_dropped(stage)) fail(step_text(journal_step(stage), tasks.front().input()));
    }
  }

  // Runs the stages that were committed before the next call of the caller's thread.
  void run_background() {
    while (!over()) {
      const std::optional<Stage> stage = background_stage(entry().step);
      if (!stage) return;
      run(StageTask::of_input(*stage, entry().input));
    }
  }

  void run(StageTask task) {
    std::deque<StageTask>& tasks = waiting(task.stage);
    while (can_be_dropped(task.stage) && !tasks.empty() && tasks.front() != task) tasks.pop_front();
    const auto waiting_task = std::ranges::find(tasks, task);
    if (waiting_task == tasks.end() ||
        !std::all_of(tasks.begin(), waiting_task, [&](const StageTask& ahead) { return runs_later(ahead); }))
      fail("no such task");
    tasks.erase(waiting_task);
    const map::MapSnapshot base = recorded_base();
    if (task.stage != Stage::kKeyframe && task.keyframe.index() >= base->keyframe_slots()) fail("no such keyframe");
    const CommitOutcome outcome = run_to_commit(task, base, gate_, setup_, stop_.get_token());
    if (interrupted()) return;
    const bool committed = outcome == CommitOutcome::kCommitted;
    if (is_repeated(task.stage, outcome)) tasks.push_front(task);
    if (committed != entry().committed.has_value()) fail(committed ? "a commit" : "no commit");
    if (committed) {
      keep(gate_.newest());
      for (const StageTask& next : following(task, *gate_.newest(), setup_.functions))
        waiting(next.stage).push_back(next);
    }
    advance();
  }

  // Whether a later entry is that of a task: keyframes of the caller and of the stage kKeyframe may have been enqueued
  // in another order than they were committed.
  bool runs_later(const StageTask& task) const {
    return std::any_of(
        journal_.entries.begin() + static_cast<std::ptrdiff_t>(next_), journal_.entries.end(),
        [&](const JournalEntry& e) { return e.step == journal_step(task.stage) && e.input == task.input(); });
  }

  map::MapSnapshot recorded_base() const {
    const auto kept = kept_.find(entry().base);
    if (kept == kept_.end()) fail("a version from " + std::to_string(gate_.newest()->version().value()) + " on");
    return kept->second;
  }

  void keep(map::MapSnapshot version) {
    const MapVersion number = version->version();
    if (last_use_.contains(number)) kept_[number] = std::move(version);
  }

  void advance() {
    if (last_use_.at(entry().base) == next_) kept_.erase(entry().base);
    ++next_;
  }

  const Journal journal_;
  MapGate& gate_;
  const ExecutionSetup setup_;
  std::size_t next_ = 0;                         // index of the current entry
  std::map<MapVersion, std::size_t> last_use_;   // index of the last entry that uses a version
  std::map<MapVersion, map::MapSnapshot> kept_;  // versions still needed
  std::array<std::deque<StageTask>, kStages.size()> waiting_;
  std::stop_source stop_;
};

}  // namespace

std::unique_ptr<StageExecutor> make_replay_executor(Journal journal, MapGate& gate, ExecutionSetup setup) {
  return std::make_unique<ReplayExecutor>(std::move(journal), gate, std::move(setup));
}

}  // namespace bslam::execution
