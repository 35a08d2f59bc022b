#include "system/system.h"

#include <algorithm>
#include <ranges>

#include "base/stopwatch.h"
#include "map/rigs_of_map.h"
#include "mapping/map_keyframe.h"
#include "system/cameras_of_run.h"
#include "system/final_poses.h"
#include "system/relocaliser.h"
#include "system/use_calibration.h"

namespace bslam::system {
namespace {

map::BundledMap empty_map(const camera::Rig& rig, const camera::Rig& given, const Config& config) {
  map::BundledMap map(std::make_shared<const camera::Rig>(rig), config.feature_model().pyramid);
  map.set_given_rig(std::make_shared<const camera::Rig>(given));
  return map;
}

void add_pose(std::vector<SubmapTrajectory>& submaps, KeyframeId root, TimeNs time_ns,
              const geometry::SE3& T_world_cam0) {
  auto submap = std::ranges::find(submaps, root, &SubmapTrajectory::root);
  if (submap == submaps.end()) submap = submaps.insert(submaps.end(), {root, {}, false});
  submap->poses.push_back({time_ns, T_world_cam0});
}

// Finds the cameras of the run in a loaded map; if it does not have them, they are appended.
CamerasOfRun find_cameras(std::optional<map::BundledMap>& map, const camera::Rig& rig) {
  return {map ? map::find_or_append_rig(*map, rig) : 0, rig.size()};
}

// If the map has cameras of other rigs, their calibration is constant.
Config config_for(Config config, std::size_t cameras_of_run, const camera::Rig& rig) {
  return cameras_of_run == rig.size() ? config : without_calibration(std::move(config));
}

}  // namespace

System::System(camera::Rig rig, Config config, Resources resources)
    : cameras_(find_cameras(resources.map, rig)),
      rig_(resources.map ? map::with_cameras(resources.map->given_rig(), cameras_.first, rig) : rig),
      run_rig_(std::move(rig)),
      config_(config_for(std::move(config), cameras_.size, rig_)),
      first_keyframe_(resources.map ? resources.map->keyframe_slots() : 0),
      doubt_(resources.map ? std::nullopt : std::optional<tracking::MapDoubt>(run_rig_)),
      closer_(make_loop_closer(config_, resources.vocabulary)),
      keyframe_maker_(
          rig_, config_, make_relocaliser(resources.vocabulary, config_),
          [this](const tracking::CreatedKeyframe& created, TimeNs time_ns) { records_.add_created(created, time_ns); }),
      pipeline_(rig_, cameras_, config_, widened(std::move(resources.masks), cameras_, rig_.size()),
                make_relocaliser(resources.vocabulary, config_), &keyframe_maker_),
      history_(resources.history),
      store_(resources.map ? std::move(*resources.map)
                           : empty_map(resources.initial_rig.value_or(rig_), rig_, config_)),
      initial_rig_(store_.snapshot()->shared_rig()),
      gate_(store_, history_ == 0) {
  const map::MapSnapshot map = store_.snapshot();
  for (const KeyframeId k : map->keyframe_ids()) records_.set_keyframe_time(k, map->keyframe(k).frame->time_ns);
  const auto note_loop = [this](const LoopRecord& loop) { records_.add_loop(loop); };
  const auto note_run = [this](const execution::StageRun& run) { records_.add_stage_run(run); };
  execution::ExecutionSetup setup{make_stages(config_, keyframe_maker_, rig_, first_keyframe_, closer_, note_loop),
                                  config_.execution, note_run};
  executor_ = resources.replay ? execution::make_replay_executor(std::move(*resources.replay), gate_, std::move(setup))
                               : execution::make_stage_executor(config_.mode, gate_, std::move(setup));
}

System::~System() = default;

// Discards a wrong initialisation, including the poses it returned and the loops in its map.
void System::discard_map() {
  for (FrameRecord& record : frames_) {
    if (record.result.status != tracking::TrackStatus::kTracking) continue;
    record.result.status = tracking::TrackStatus::kLost;
    record.result.reason = tracking::LostReason::kNotStarted;
    record.result.anchored = {};
    record.result.covariance.reset();
    record.twist.reset();
    record.relocalisation.reset();
    record.root = KeyframeId();
    record.keyframe = false;
    record.created.reset();
  }
  early_.clear();
  pipeline_.restart();
  executor_->restart();
  if (closer_ && !executor_->over()) closer_->begin_path();  // no stage is running, unless the run was interrupted
  records_.discard_map();
  created_keyframes_.clear();
  frames_.back().map_withdrawn = true;
}

Result<FrameRecord> System::process(const image::ImageBundle& images) {
  if (const Status valid = check_frame(images, run_rig_, last_input_); !valid) return valid.error();
  last_input_ = FrameStamp{images.id, images.time_ns};
  const bool whole = cameras_.size == rig_.size();
  Pipeline::Outcome outcome = whole ? pipeline_.process(images, *executor_)
                                    : pipeline_.process(widened(images, cameras_, rig_.size()), *executor_);
  narrow(outcome.record, cameras_);
  narrow(outcome.observed, cameras_);
  maps_started_ += outcome.started_submap;
  observed_ = std::move(outcome.observed);
  std::ranges::move(outcome.early, std::back_inserter(early_));
  for (const auto& [k, time_ns] : outcome.keyframes) records_.set_keyframe_time(k, time_ns);
  const Stopwatch watch;
  for (const auto& added : outcome.keyframes) executor_->enqueue(added.id);
  if (outcome.deferred) enqueue(*outcome.deferred, outcome.record.result.time_ns);
  if ((outcome.deferred || !outcome.keyframes.empty()) && config_.mode != execution::Mode::kSequential) {
    outcome.record.stages.push_back({"wait", watch.ms()});
    outcome.record.frame_ms += watch.ms();
  }
  const bool compared =
      config_.calibration.refine == calibration::Refine::kFalse || execution::calibration_compared(*outcome.seen);
  const bool wrong_map = doubt_ && doubt_->update(outcome.record, *outcome.seen, compared);
  frames_.push_back(std::move(outcome.record));
  mark_created_keyframes();
  if (wrong_map) discard_map();
  FrameRecord record = frames_.back();
  bound_history();
  return record;
}

void System::set_reduction(int level) {
  if (level == pipeline_.reduction()) return;
  executor_->note_reduction(level);
  pipeline_.set_reduction(level);
}

void System::enqueue(FrameId frame, TimeNs time_ns) {
  if (executor_->over()) return keyframe_maker_.withdraw(frame);
  records_.add_deferred(frame, time_ns);
  executor_->enqueue({execution::Stage::kKeyframe, KeyframeId(), frame});
}

// Marks the frames from which keyframes were created since the last call. Their poses become those of the keyframes.
void System::mark_created_keyframes() {
  created_keyframes_.clear();
  for (const tracking::CreatedKeyframe& created : records_.take_created()) {
    const auto record = find_record(frames_, created.frame);
    if (record == frames_.end()) continue;
    record->keyframe = true;
    record->result.anchored = {.reference = created.keyframe, .T_rig_reference = geometry::SE3()};
    created_keyframes_.push_back(*record);
  }
}

// Drops the oldest records once there are twice as many as configured, so that the mean time per frame is constant.
void System::bound_history() {
  if (history_ == 0 || frames_.size() / 2 < history_) return;
  if (records_.creates_keyframes() && !executor_->over()) return;  // their frames will be marked
  frames_.erase(frames_.begin(), frames_.end() - static_cast<std::ptrdiff_t>(history_));
  std::erase_if(early_, [&](const auto& early) { return early.frame->id < frames_.front().result.frame; });
  records_.keep_latest(history_);
}

void System::finish() {
  executor_->drain();
  if (!interruption_.stop_requested()) {  // else the worker of a stage may still use it
    pipeline_.free_scratch_memory();
    keyframe_maker_.free_scratch_memory();
  }
  mark_created_keyframes();
  if (config_.final_adjustment && !config_.localize_only && !executor_->over()) {
    const Stopwatch watch;
    map::MapDraft draft(gate_.newest());
    const auto stop = interruption_.get_token();
    draft.set_twists(twists_from_neighbours(draft.map(), first_keyframe_, frames_));
    mapping::adjust_globally(config_.mapping, config_.feature_model(), draft, stop);
    final_adjustment_ms_ = watch.ms();
    calibrate(draft, stop);
    if (!stop.stop_requested()) executor_->commit(execution::JournalStep::kFinal, std::move(draft));
  }
  calibration_refined_ = !store_.snapshot()->rig().same_calibration(*initial_rig_);
  locate_early_frames();
  executor_->end();
}

// Determines the poses of the frames during monocular initialisations in the final map.
void System::locate_early_frames() {
  const map::MapSnapshot map = store_.snapshot();
  for (const tracking::BetweenKeyframes& early : early_) {
    const auto record = find_record(frames_, early.frame->id);
    if (record == frames_.end()) continue;
    if (record->result.status == tracking::TrackStatus::kTracking) continue;
    if (auto found = pipeline_.tracker().locate_early(*map, early)) {
      narrow(*found, cameras_);
      record->found_later = std::make_shared<const tracking::TrackResult>(std::move(*found));
    }
  }
}

// Estimates the calibration from the map. If it is accepted, adjusts the map again with it. With new moves of cameras,
// it is estimated again.
void System::calibrate(map::MapDraft& draft, const std::stop_token& stop) {
  const auto& options = config_.calibration;
  if ((!options.check && options.refine == calibration::Refine::kFalse) || stop.stop_requested()) return;
  const Stopwatch watch;
  constexpr int kMaxEstimates = 3;
  bool again = true;
  for (int i = 0; i < kMaxEstimates && again && !stop.stop_requested(); ++i) {
    auto estimate = calibration::refine_rig(draft.map(), rig_, options, config_.feature_model(), stop, first_keyframe_);
    const bool accepted = calibration::accepted(estimate, options);
    if (i == 0 || accepted) calibration_ = std::move(estimate);
    if (!accepted) break;
    again = use_calibration(calibration_, config_, draft, stop);
  }
  calibration_.poses = {};                                   // part of the map now
  if (!draft.map().rig().same_calibration(*initial_rig_)) {  // a calibration during the run moves the roots
    for (const KeyframeId root : draft.map().roots()) {
      if (root >= first_keyframe_) calibration::move_submap(root, geometry::SE3(), draft);
    }
  }
  calibration_ms_ = watch.ms();
}

camera::Rig System::rig() const { return map::cameras_of(snapshot()->rig(), cameras_.first, cameras_.size); }

void System::interrupt() {
  interruption_.request_stop();
  executor_->interrupt();
}

std::vector<SubmapTrajectory> System::trajectories() const {
  const map::MapSnapshot map = store_.snapshot();
  std::vector<SubmapTrajectory> out;
  const std::vector<KeyframeId> root = map->root_of_each();
  std::vector<std::optional<geometry::SE3>> between;
  if (calibration_refined_) between = poses_between_keyframes(*map, first_keyframe_, frames_);
  for (std::size_t i = 0; i < frames_.size(); ++i) {
    const tracking::TrackResult& r = frames_[i].final_result();
    if (const auto T_rig_world = between.empty() ? T_rig_world_of(frames_[i], *map) : between[i])
      add_pose(out, root[r.anchored.reference.index()], r.time_ns, T_rig_world->inverse());
  }
  for (SubmapTrajectory& submap : out) submap.loaded = submap.root < first_keyframe_;
  std::stable_sort(out.begin(), out.end(), [](const SubmapTrajectory& a, const SubmapTrajectory& b) {
    return a.poses.size() > b.poses.size();
  });
  return out;
}

std::vector<SubmapTrajectory> System::live_trajectories() const {
  std::vector<SubmapTrajectory> out;
  for (const FrameRecord& record : frames_) {
    if (record.result.status != tracking::TrackStatus::kTracking) continue;
    add_pose(out, record.root, record.result.time_ns, record.result.T_rig_world.inverse());
  }
  for (SubmapTrajectory& submap : out) submap.loaded = submap.root < first_keyframe_;
  const std::vector<SubmapTrajectory> final = trajectories();
  const KeyframeId main = final.empty() ? KeyframeId() : final.front().root;
  std::stable_sort(out.begin(), out.end(), [&](const SubmapTrajectory& a, const SubmapTrajectory& b) {
    if ((a.root == main) != (b.root == main)) return a.root == main;
    return a.poses.size() > b.poses.size();
  });
  return out;
}

SystemMemory System::memory() const {
  MemoryCount count;
  return {.map = store_.snapshot()->memory(count),
          .place_index = (closer_ ? closer_->memory_bytes() : 0) + pipeline_.place_index_bytes() +
                         keyframe_maker_.place_index_bytes(),
          .pyramids = pipeline_.pyramid_bytes() + keyframe_maker_.pyramid_bytes()};
}

}  // namespace bslam::system
