#include "execution/stage.h"

namespace bslam::execution {

std::string_view stage_name(Stage stage) {
  switch (stage) {
    case Stage::kKeyframe:
      return "keyframe";
    case Stage::kMap:
      return "map";
    case Stage::kCalibrate:
      return "calibrate";
    case Stage::kLoop:
      return "loop";
    case Stage::kGlobal:
      return "global";
  }
  return "";
}

StageTask StageTask::of_input(Stage stage, std::int32_t input) {
  return stage == Stage::kKeyframe ? StageTask{stage, KeyframeId(), FrameId(input)}
                                   : StageTask{stage, KeyframeId(input)};
}

std::optional<int> calibration_due(KeyframeId keyframe) {
  constexpr std::size_t kFirst = 8;  // keyframes
  int number = 0;
  for (std::size_t due = kFirst; due <= keyframe.index(); due += due / 2, ++number) {
    if (due == keyframe.index()) return number;
  }
  return std::nullopt;
}

std::vector<StageTask> following(const StageTask& task, const StageFunctions& functions) {
  std::vector<StageTask> out;
  const auto add = [&](Stage stage) {
    if (functions[stage]) out.push_back({stage, task.keyframe});
  };
  if (task.stage == Stage::kKeyframe) add(Stage::kMap);
  if (task.stage == Stage::kMap && calibration_due(task.keyframe)) add(Stage::kCalibrate);
  if (task.stage == Stage::kMap) add(Stage::kLoop);
  if (task.stage == Stage::kLoop) add(Stage::kGlobal);
  return out;
}

std::vector<Stage> superseded_by(Stage stage) {
  if (stage == Stage::kLoop) return {Stage::kCalibrate, Stage::kGlobal};
  if (stage == Stage::kCalibrate) return {Stage::kGlobal};
  return {};
}

std::vector<Stage> superseded_by(Stage stage, const StageResult& result, const map::BundledMap& newest) {
  if (!result.draft || result.draft->superseded(newest)) return {};
  return superseded_by(stage);
}

}  // namespace bslam::execution
