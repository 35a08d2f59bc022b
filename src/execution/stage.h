// Background stages (mapping, loop closing, global adjustment) as functions over values: their input, their result, and
// which stage follows. A StageExecutor decides when and in which thread they run.
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <optional>
#include <stop_token>
#include <string_view>

#include "base/id.h"
#include "map/map_store.h"

namespace bslam::execution {

// Each stage has a queue of its own, first in, first out, and runs one task at a time. A new keyframe is a task of
// kMap; a commit of kMap makes one of kLoop, a commit of kLoop one of kGlobal.
enum class Stage { kMap, kLoop, kGlobal };
inline constexpr std::array<Stage, 3> kStages = {Stage::kMap, Stage::kLoop, Stage::kGlobal};

std::string_view stage_name(Stage stage);

struct StageTask {
  Stage stage = Stage::kMap;
  KeyframeId keyframe;  // that caused it
  friend bool operator==(const StageTask&, const StageTask&) = default;
};

struct StageResult {
  std::optional<map::MapDraft>
      draft;  // of the version the stage was given; none: nothing to change, and nothing follows
  // Called when the draft is in the map and never otherwise, in order of the commits and before the next one, by
  // whatever thread commits. For what is to be told of the result; may be empty.
  std::function<void(const map::CommitReport&)> committed;
};

// Once a stop is requested its result no longer counts: it may return anything as soon as it can. The keyframe may have
// been removed from the version given.
using StageFunction = std::function<StageResult(const StageTask&, const map::MapSnapshot&, std::stop_token)>;

// By stage; an empty function: the stage never runs, and nothing follows.
struct StageFunctions {
  std::array<StageFunction, kStages.size()> by_stage;
  const StageFunction& operator[](Stage s) const { return by_stage[static_cast<std::size_t>(s)]; }
  StageFunction& operator[](Stage s) { return by_stage[static_cast<std::size_t>(s)]; }
};

// The task that follows the commit of another one, if any.
std::optional<StageTask> following(const StageTask& task, const StageFunctions& functions);

// The stage whose tasks, waiting or running, are dropped when a result of `stage` goes into the map. A closed loop
// moves the map, so a global adjustment of the map before it is worth nothing, and another one follows.
std::optional<Stage> superseded_by(Stage stage);
// The same before the commit of a result to `newest`, the newest version: empty where nothing will be committed.
std::optional<Stage> superseded_by(Stage stage, const StageResult& result, const map::BundledMap& newest);

// One run of a stage, for whoever watches.
struct StageRun {
  StageTask task;
  double ms = 0;
  bool committed = false;  // false: it had nothing to change, or was superseded
};

// Called from any thread, also from several at once.
using StageObserver = std::function<void(const StageRun&)>;

}  // namespace bslam::execution
