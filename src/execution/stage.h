// Stages that run behind tracking, as functions over values: what they are given, what they answer, what follows them.
// When and where they run is the business of a StageExecutor.
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <optional>
#include <stop_token>
#include <string_view>
#include <vector>

#include "base/id.h"
#include "map/map_store.h"

namespace bslam::execution {

// A lane each: one task at a time, first in, first out. A keyframe goes to kMap. What a stage committed calls for the
// next one: kMap for kLoop, kLoop for kGlobal.
enum class Stage { kMap, kLoop, kGlobal };
inline constexpr std::array<Stage, 3> kStages = {Stage::kMap, Stage::kLoop, Stage::kGlobal};

std::string_view stage_name(Stage stage);

struct StageTask {
  Stage stage = Stage::kMap;
  KeyframeId keyframe;  // that caused it
  friend bool operator==(const StageTask&, const StageTask&) = default;
};

// A figure that a stage tells of its run: landmarks it created, observations it adjusted, ...
struct StageStatistic {
  std::string_view name;  // a literal
  double value = 0;
};

struct StageResult {
  std::optional<map::MapDraft>
      draft;  // of the version the stage was given; none: nothing to change, and nothing follows
  // Called when the draft is in the map and never otherwise, in order of the commits and before the next one, by
  // whatever thread commits. For what is to be told of the result; may be empty.
  std::function<void(const map::CommitReport&)> committed;
  std::vector<StageStatistic> statistics = {};
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

// The task that a committed one calls for, if any.
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
  std::vector<StageStatistic> statistics = {};
};

// Called from any thread, also from several at once.
using StageObserver = std::function<void(const StageRun&)>;

}  // namespace bslam::execution
