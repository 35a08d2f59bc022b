#include "execution/stage.h"

namespace bslam::execution {

std::string_view stage_name(Stage stage) {
  switch (stage) {
    case Stage::kMap:
      return "map";
    case Stage::kLoop:
      return "loop";
    case Stage::kGlobal:
      return "global";
  }
  return "";
}

std::optional<StageTask> following(const StageTask& task, const StageFunctions& functions) {
  if (task.stage == Stage::kGlobal) return std::nullopt;
  const StageTask next{task.stage == Stage::kMap ? Stage::kLoop : Stage::kGlobal, task.keyframe};
  if (!functions[next.stage]) return std::nullopt;
  return next;
}

std::optional<Stage> superseded_by(Stage stage) {
  return stage == Stage::kLoop ? std::optional(Stage::kGlobal) : std::nullopt;
}

std::optional<Stage> superseded_by(Stage stage, const StageResult& result, const map::BundledMap& newest) {
  if (!result.draft || result.draft->superseded(newest)) return std::nullopt;
  return superseded_by(stage);
}

}  // namespace bslam::execution
