#include "system/system.h"

#include "mapping/map_keyframe.h"
#include "system/stopwatch.h"

namespace bslam::system {
namespace {

constexpr std::size_t kYoungMap = 4;  // keyframes: a map lost before it has grown beyond them was no good start

// Lost although there was something to see: the map, not the images, is in doubt.
bool disowns_map(const tracking::TrackResult& result) {
  using tracking::LostReason;
  return result.reason == LostReason::kFewMatches || result.reason == LostReason::kFewInliers ||
         result.reason == LostReason::kUnstablePose;
}

map::BundledMap empty_map(const camera::Rig& rig, const Config& config) {
  return map::BundledMap(std::make_shared<const camera::Rig>(rig), {config.features.scale_factor, config.features.levels});
}

}  // namespace

System::System(camera::Rig rig, Config config, std::vector<image::Image> masks)
    : rig_(std::move(rig)), config_(std::move(config)), pipeline_(rig_, config_, std::move(masks)),
      store_(empty_map(rig_, config_)) {
  mapping_ = make_mapping_executor(store_, config_, [this](KeyframeId k, double ms) {
    const auto frame = store_.snapshot()->keyframe(k).frame;  // gone where the keyframe was culled at once
    const std::lock_guard lock(records_mutex_);
    mapping_runs_.push_back({k, frame ? frame->time_ns : 0, ms});
  });
}

System::~System() = default;

// A start up to scale can be wrong and shows it at once: the next frames find nothing. What it told is withdrawn.
void System::give_up_young_map() {
  mapping_->drain();
  for (FrameRecord& record : frames_) {
    if (record.map_number != maps_started_ || record.result.status != tracking::TrackStatus::kTracking) continue;
    record.result.status = tracking::TrackStatus::kLost;
    record.result.reason = tracking::LostReason::kNotStarted;
    record.keyframe = false;
  }
  pipeline_.restart();
  store_.restart(empty_map(rig_, config_));
}

const FrameRecord& System::process(const image::ImageBundle& images) {
  const bool had_map = pipeline_.state().status != tracking::TrackStatus::kNotStarted;
  Pipeline::Outcome outcome = pipeline_.process(images, store_);
  if (!had_map && !outcome.keyframes.empty()) ++maps_started_;
  const Stopwatch watch;
  for (const KeyframeId k : outcome.keyframes) mapping_->enqueue(k);
  if (!outcome.keyframes.empty() && config_.mode == Mode::kParallel) {
    outcome.record.stages.push_back({"wait", watch.ms()});
    outcome.record.frame_ms += watch.ms();
  }
  outcome.record.map_number = maps_started_;
  frames_.push_back(std::move(outcome.record));
  const bool failed = had_map && disowns_map(frames_.back().result);
  if (failed && store_.snapshot()->scale() != map::Scale::kMetric && store_.snapshot()->keyframe_slots() <= kYoungMap) {
    give_up_young_map();
  }
  return frames_.back();
}

void System::finish() {
  mapping_->drain();
  if (!config_.final_adjustment) return;
  const Stopwatch watch;
  map::MapDraft draft("global adjustment", store_.snapshot());
  mapping::adjust_globally(config_.mapping, config_.feature_model(), draft);
  store_.commit(std::move(draft));
  final_adjustment_ms_ = watch.ms();
}

std::vector<MappingRecord> System::mapping_runs() const {
  const std::lock_guard lock(records_mutex_);
  return mapping_runs_;
}

evaluation::Trajectory System::trajectory() const {
  const map::MapSnapshot map = store_.snapshot();
  evaluation::Trajectory out;
  for (const FrameRecord& record : frames_) {
    const tracking::TrackResult& r = record.result;
    if (r.status != tracking::TrackStatus::kTracking || record.map_number != maps_started_) continue;
    out.push_back({r.time_ns, (r.T_rig_reference * map->resolved_pose(r.reference)).inverse()});
  }
  return out;
}

evaluation::Trajectory System::live_trajectory() const {
  evaluation::Trajectory out;
  for (const FrameRecord& record : frames_) {
    if (record.result.status != tracking::TrackStatus::kTracking) continue;
    out.push_back({record.result.time_ns, record.result.T_rig_world.inverse()});
  }
  return out;
}

}  // namespace bslam::system
