#include "system/stages.h"

#include "calibration/path_scale.h"
#include "mapping/map_keyframe.h"
#include "system/use_calibration.h"

namespace bslam::system {
namespace {

// `rig_prior`: information of the given calibration if it is to be compared with the images of the map, otherwise null.
execution::StageResult map_keyframe(const Config& config, const std::shared_ptr<const Eigen::MatrixXd>& rig_prior,
                                    const execution::StageTask& task, const map::MapSnapshot& base,
                                    std::stop_token stop) {
  if (!base->alive(task.keyframe)) return {};
  map::MapDraft draft(base);
  mapping::map_keyframe(task.keyframe, config.mapping, config.feature_model(), draft, std::move(stop),
                        execution::calibration_uncertain(task.keyframe, *base) ? rig_prior : nullptr);
  return {std::move(draft), {}};
}

execution::StageResult close_loop(looping::LoopCloser& closer, const LoopObserver& observer,
                                  const execution::StageTask& task, const map::MapSnapshot& base) {
  if (!base->alive(task.keyframe)) return {};
  map::MapDraft draft(base);
  const auto closure = closer.close(task.keyframe, draft);
  if (!closure) return {};
  const auto time_of = [&](KeyframeId k) { return base->keyframe(k).frame->time_ns; };
  const LoopRecord record{*closure, time_of(closure->keyframe), time_of(closure->matched_keyframe)};
  return {std::move(draft), [&closer, observer, record](const map::CommitReport&) {
            closer.committed(record.closure);
            observer(record);
          }};
}

// The parameter of map_keyframe. A map that was loaded has been compared with its calibration.
std::shared_ptr<const Eigen::MatrixXd> rig_prior(const calibration::CalibrationOptions& options,
                                                 const camera::Rig& given_rig, KeyframeId first) {
  if (options.refine == calibration::Refine::kFalse || given_rig.size() < 2 || first.index() > 0) return nullptr;
  return std::make_shared<const Eigen::MatrixXd>(calibration::prior_information(given_rig, options));
}

// Returns true if a calibration that is due can be skipped. Images that contradict the calibration already do so in the
// first estimates. If the first ones agree with it, every fourth one of the following is sufficient. A map that was
// loaded, or whose scale had to be estimated, may have had no estimate yet.
// `number`: counted from 0.
bool left_out(int number, const calibration::CalibrationOptions& options, const map::BundledMap& map,
              const camera::Rig& given_rig, KeyframeId first) {
  if (options.refine == calibration::Refine::kTrue || calibration::replaced(map.rig(), given_rig)) return false;
  if (first.index() > 0 || map.scale_deviation() > 0) return false;
  constexpr int kFirst = 3, kEvery = 4;
  return number >= kFirst && (number + 1) % kEvery != kFirst;
}

// The options of a calibration, by its number. The first one has few images, and is only used if the given calibration
// is so wrong that it spoils the map: if it doubles the root mean square of the reprojection errors.
calibration::CalibrationOptions options_of(int number, calibration::CalibrationOptions options) {
  constexpr double kLargeExcess = 3.0;
  if (number > 0) return options;
  options.refine = calibration::Refine::kAuto;
  options.inconsistent_excess = std::max(options.inconsistent_excess, kLargeExcess);
  return options;
}

// Replaces the rig by its estimate from the map so far, and adjusts the map with it. The newest keyframe keeps its
// pose, so that the current pose of the rig does not jump, unless it is in a loaded submap.
execution::StageResult calibrate(const Config& config, const camera::Rig& given_rig, KeyframeId first,
                                 const execution::StageTask& task, const map::MapSnapshot& base,
                                 const std::stop_token& stop) {
  const int number = execution::calibration_due(task.keyframe, *base).value_or(0);
  if (left_out(number, config.calibration, *base, given_rig, first)) return {};
  const auto options = options_of(number, config.calibration);
  auto refinement = calibration::refine_if_accepted(*base, given_rig, options, config.feature_model(), stop, first);
  if (!refinement) return {};
  // The path before the first one is too short to tell the scale better than the baselines.
  if (number > 0) calibration::keep_scale(options, *refinement);
  map::MapDraft draft(base);
  use_calibration(*refinement, config, draft, stop);
  const KeyframeId newest = base->newest_keyframe();
  if (draft.map().alive(newest) && draft.map().root_of(newest) >= first)
    calibration::move_submap(newest, base->keyframe(newest).T_rig_world, draft);
  return {std::move(draft), {}};
}

execution::StageResult adjust_globally(const Config& config, const map::MapSnapshot& base, std::stop_token stop) {
  map::MapDraft draft(base);
  mapping::adjust_globally(config.mapping, config.feature_model(), draft, std::move(stop));
  return {std::move(draft), {}};
}

}  // namespace

std::shared_ptr<looping::LoopCloser> make_loop_closer(const Config& config, const place::VocabularyPtr& vocabulary) {
  if (!config.looping.loop.enabled || !vocabulary) return nullptr;
  auto recogniser = std::make_unique<looping::BagOfWordsRecogniser>(vocabulary, config.looping.recognition);
  return std::make_shared<looping::LoopCloser>(std::move(recogniser), config.looping, config.feature_model(),
                                               static_cast<std::uint64_t>(config.seed));
}

execution::StageFunctions make_stages(const Config& config, KeyframeMaker& keyframe_maker, const camera::Rig& given_rig,
                                      KeyframeId first, std::shared_ptr<looping::LoopCloser> closer,
                                      LoopObserver observer) {
  execution::StageFunctions functions;
  functions[execution::Stage::kKeyframe] = [&keyframe_maker](const execution::StageTask& task,
                                                             const map::MapSnapshot& base, std::stop_token) {
    return keyframe_maker.make(task.frame, base);
  };
  functions[execution::Stage::kMap] = [&config, prior = rig_prior(config.calibration, given_rig, first)](
                                          const execution::StageTask& task, const map::MapSnapshot& base,
                                          std::stop_token stop) {
    return map_keyframe(config, prior, task, base, std::move(stop));
  };
  functions[execution::Stage::kGlobal] = [&config](const execution::StageTask&, const map::MapSnapshot& base,
                                                   std::stop_token stop) {
    return adjust_globally(config, base, std::move(stop));
  };
  if (config.calibration.refine != calibration::Refine::kFalse) {
    functions[execution::Stage::kCalibrate] = [&config, &given_rig, first](const execution::StageTask& task,
                                                                           const map::MapSnapshot& base,
                                                                           const std::stop_token& stop) {
      return calibrate(config, given_rig, first, task, base, stop);
    };
  }
  if (!closer) return functions;
  functions[execution::Stage::kLoop] = [closer = std::move(closer), observer = std::move(observer)](
                                           const execution::StageTask& task, const map::MapSnapshot& base,
                                           std::stop_token) { return close_loop(*closer, observer, task, base); };
  return functions;
}

}  // namespace bslam::system
