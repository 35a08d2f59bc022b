#include "execution/stage.h"

#include <algorithm>

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

namespace {

// The numbers of keyframes before the first calibrations. The first one finds large errors, which would spoil the map.
constexpr std::size_t kFirstCalibration = 4, kSecondCalibration = 8, kThirdCalibration = 12;

// The number of keyframes at which the next calibration is due. Each further quarter of observations makes the
// estimate of a wrong calibration, and so the poses of the following frames, noticeably more accurate.
std::size_t next_calibration(std::size_t due) {
  if (due < kThirdCalibration) return due < kSecondCalibration ? kSecondCalibration : kThirdCalibration;
  return due + due / 4;
}

// The number of keyframe slots from the first keyframe of the map to this one. Maps that were discarded before do not
// count.
std::size_t slots_before(KeyframeId keyframe, const map::BundledMap& map) {
  std::size_t first = 0;
  while (first < map.keyframe_slots() && !map.alive(KeyframeId(first))) ++first;
  return keyframe.index() - std::min(first, keyframe.index());
}

}  // namespace

std::optional<int> calibration_due(KeyframeId keyframe, const map::BundledMap& map) {
  const std::size_t before = slots_before(keyframe, map);
  int number = 0;
  for (std::size_t due = kFirstCalibration; due <= before; due = next_calibration(due), ++number) {
    if (due == before) return number;
  }
  return std::nullopt;
}

bool calibration_compared(const map::BundledMap& map) {
  return slots_before(KeyframeId(map.keyframe_slots()), map) > kFirstCalibration;
}

bool calibration_uncertain(KeyframeId keyframe, const map::BundledMap& map) {
  return slots_before(keyframe, map) <= kSecondCalibration;
}

bool awaited(const StageTask& task, const map::BundledMap& newest) {
  constexpr int kVerdicts = 3, kRefinements = 9;  // calibrations
  switch (task.stage) {
    case Stage::kKeyframe:
    case Stage::kMap:
      return slots_before(KeyframeId(newest.keyframe_slots()), newest) <= kThirdCalibration + 1;
    case Stage::kCalibrate: {
      const int number = calibration_due(task.keyframe, newest).value_or(kRefinements);
      return number < kVerdicts || (newest.rig_deviation() && number < kRefinements);
    }
    case Stage::kLoop:
    case Stage::kGlobal:
      break;
  }
  return false;
}

bool is_repeated(Stage stage, CommitOutcome outcome) {
  return outcome == CommitOutcome::kRejected &&
         (stage == Stage::kMap || stage == Stage::kCalibrate || stage == Stage::kGlobal);
}

std::vector<StageTask> following(const StageTask& task, const map::BundledMap& newest,
                                 const StageFunctions& functions) {
  std::vector<StageTask> out;
  const auto add = [&](Stage stage) {
    if (functions[stage]) out.push_back({stage, task.keyframe});
  };
  if (task.stage == Stage::kKeyframe) add(Stage::kMap);
  if (task.stage == Stage::kMap && calibration_due(task.keyframe, newest)) add(Stage::kCalibrate);
  if (task.stage == Stage::kMap) add(Stage::kLoop);
  if (task.stage == Stage::kLoop) add(Stage::kGlobal);
  return out;
}

namespace {

// The tasks that a result of `stage` supersedes. `corrects`: it moves the map.
Superseded superseded(Stage stage, bool corrects) {
  Superseded out;
  if (stage == Stage::kCalibrate || stage == Stage::kLoop) out.dropped = {Stage::kGlobal};
  if (stage == Stage::kLoop && corrects) out.restarted = {Stage::kCalibrate};
  return out;
}

}  // namespace

Superseded superseded_by(Stage stage, const StageResult& result, const map::BundledMap& newest) {
  if (!result.draft || result.draft->superseded(newest)) return {};
  return superseded(stage, result.draft->corrects());
}

bool can_be_dropped(Stage stage) {
  return std::ranges::any_of(kStages, [&](Stage by) {
    const std::vector<Stage> dropped = superseded(by, true).dropped;
    return std::ranges::find(dropped, stage) != dropped.end();
  });
}

}  // namespace bslam::execution
