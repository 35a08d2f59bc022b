// Background stages (creation of keyframes, mapping, self-calibration, loop closing, global adjustment) as functions of
// values: their input, their result, and the stage that follows. A StageExecutor decides when and in which thread they
// run.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <stop_token>
#include <string_view>
#include <vector>

#include "base/id.h"
#include "map/map_store.h"

namespace bslam::execution {

// Each stage has its own first-in, first-out queue and runs one task at a time. A frame that is to become a keyframe
// creates a task of kKeyframe, a new keyframe one of kMap, a commit of kMap a task of kLoop and sometimes one of
// kCalibrate, and a commit of kLoop a task of kGlobal. A stage is followed by later ones only.
enum class Stage { kKeyframe, kMap, kCalibrate, kLoop, kGlobal };
inline constexpr std::array<Stage, 5> kStages = {Stage::kKeyframe, Stage::kMap, Stage::kCalibrate, Stage::kLoop,
                                                 Stage::kGlobal};

std::string_view stage_name(Stage stage);

struct StageTask {
  Stage stage = Stage::kMap;
  KeyframeId keyframe;  // the keyframe that caused the task; for kKeyframe: the keyframe it has created, once committed
  FrameId frame = {};   // for kKeyframe: the frame that caused the task

  // Identifies the task among those of its stage: id of the frame or keyframe that caused it.
  std::int32_t input() const { return stage == Stage::kKeyframe ? frame.value() : keyframe.value(); }
  static StageTask of_input(Stage stage, std::int32_t input);
  friend bool operator==(const StageTask&, const StageTask&) = default;
};

struct StageResult {
  // Draft of the version passed to the stage; nullopt: nothing is changed, and no stage follows.
  std::optional<map::MapDraft> draft;
  // Called after the draft was committed, in the committing thread and before the next commit; never called if it was
  // not committed. May be empty.
  std::function<void(const map::CommitReport&)> committed;
};

// What became of the result of a task.
enum class CommitOutcome {
  kCommitted,
  kUnchanged,  // there was nothing to change
  kStopped,    // a stop was requested before; the journal has no entry
  kRejected,   // it corrects the map, and another correction has been committed since its base (map::MapDraft)
};

// Whether a task whose result was rejected is run again, on the newest version: that of a stage whose result depends on
// nothing but the map. A loop is found again with a later keyframe.
bool is_repeated(Stage stage, CommitOutcome outcome);

// After a stop request the result is discarded, so that the function should return early with any result. The keyframe
// may have been removed from the version passed to the function.
using StageFunction = std::function<StageResult(const StageTask&, const map::MapSnapshot&, std::stop_token)>;

// Functions by stage. If a function is empty, the stage never runs and no stage follows.
struct StageFunctions {
  std::array<StageFunction, kStages.size()> by_stage;
  const StageFunction& operator[](Stage s) const { return by_stage[static_cast<std::size_t>(s)]; }
  StageFunction& operator[](Stage s) { return by_stage[static_cast<std::size_t>(s)]; }
};

// The tasks that follow the commit of another one, in order. The keyframe of the task must be known. `newest` is the
// newest version of the map.
std::vector<StageTask> following(const StageTask& task, const map::BundledMap& newest, const StageFunctions& functions);

// Number of the calibration of the rig that follows the mapping of a keyframe, counted from 0; nullopt if none does.
// The keyframes at which calibrations run are spaced geometrically, because the cost of a calibration grows with the
// size of the map and its benefit decreases.
std::optional<int> calibration_due(KeyframeId keyframe, const map::BundledMap& map);

// Whether the calibration has been compared with the images of the map: the first one was due before.
bool calibration_compared(const map::BundledMap& map);

// Whether the calibration still counts as uncertain when this keyframe is mapped, since at most the first one was
// finished before, which finds only large errors.
bool calibration_uncertain(KeyframeId keyframe, const map::BundledMap& map);

// Whether the next frame waits for a task (ExecutionOptions::await_calibration). Tracking with a wrong calibration
// loses observations, cameras or the scale, which no later adjustment brings back. The first keyframes are therefore
// mapped one after the other until three calibrations have shown whether the images agree; if they do not, some further
// calibrations are waited for as well. `newest` is the newest version of the map.
bool awaited(const StageTask& task, const map::BundledMap& newest);

// What a commit does to the tasks of other stages.
struct Superseded {
  std::vector<Stage> dropped;    // waiting and running tasks are dropped
  std::vector<Stage> restarted;  // the running task is stopped and run again on the newest version
  friend bool operator==(const Superseded&, const Superseded&) = default;
};

// The tasks that are superseded when a result of `stage` is committed; `newest` is the newest version before the
// commit, or the base of the result if they are superseded only once it was committed. After a loop closure or a
// calibration, a global adjustment of an earlier version is useless; they adjust the map themselves or another
// adjustment follows. If a loop closure moves the map and does not merely fuse landmarks, the result of a running
// calibration will be rejected. No other task estimates that calibration: it is run again, and waiting ones stay.
// Returns none if nothing will be committed.
Superseded superseded_by(Stage stage, const StageResult& result, const map::BundledMap& newest);

// Whether tasks of a stage can be dropped because of a result of another stage; a dropped task leaves no entry in the
// journal.
bool can_be_dropped(Stage stage);

// Report of one run of a stage for the observer.
struct StageRun {
  StageTask task;
  double ms = 0;
  bool committed = false;  // false: there was nothing to change, or it was superseded or rejected
};

// Must be thread-safe: called from any thread, also concurrently.
using StageObserver = std::function<void(const StageRun&)>;

}  // namespace bslam::execution
