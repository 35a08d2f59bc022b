#include "system/pipeline.h"

#include <algorithm>
#include <thread>

#include "base/stopwatch.h"
#include "frame/capture_times.h"
#include "tracking/error_floor.h"
#include "tracking/feature_budget.h"
#include "tracking/make_keyframe.h"

namespace bslam::system {
namespace {

using frame::BundledFrame;

constexpr int kMetricPatience = 5;  // frames a rig whose cameras overlap waits for depth before it starts without
constexpr int kMaxStartAge = 40;    // frames after which a start up to scale compares with a fresh frame

int thread_count(int wanted, std::size_t cameras) {
  const int available = wanted > 0 ? wanted : std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  return std::min(available, static_cast<int>(cameras));
}

// Landmarks of a keyframe by the ids given at commit.
std::vector<LandmarkId> committed(const std::vector<LandmarkId>& provisional, std::size_t base_slots,
                                  const map::CommitReport& report) {
  std::vector<LandmarkId> out;
  for (const LandmarkId l : provisional) {
    const LandmarkId id =
        l.index() < base_slots ? report.published->resolve(l) : report.landmarks[l.index() - base_slots];
    if (report.published->alive(id)) out.push_back(id);
  }
  std::sort(out.begin(), out.end());
  out.erase(std::unique(out.begin(), out.end()), out.end());
  return out;
}

// Sightings of one landmark added up, in order of id.
std::vector<map::Sighting> folded(std::vector<map::Sighting> sightings) {
  std::stable_sort(sightings.begin(), sightings.end(),
                   [](const map::Sighting& a, const map::Sighting& b) { return a.landmark < b.landmark; });
  std::vector<map::Sighting> out;
  for (const map::Sighting& s : sightings) {
    if (out.empty() || out.back().landmark != s.landmark) {
      out.push_back(s);
    } else {
      out.back().expected += s.expected;
      out.back().found += s.found;
    }
  }
  return out;
}

void count_features(const BundledFrame& frame, FrameRecord& record) {
  record.unique = static_cast<int>(frame.bundled.size());
  record.matched = static_cast<int>(frame.bundled.num_matched());
  record.monocular = static_cast<int>(frame.bundled.num_monocular());
}

// Was there enough to see for a pose?
bool saw_something(const tracking::TrackResult& result) {
  return result.reason != tracking::LostReason::kNoImages && result.reason != tracking::LostReason::kFewFeatures;
}

bool is_tracking(tracking::TrackStatus status) { return status == tracking::TrackStatus::kTracking; }

std::vector<tracking::CameraCounts> keypoint_counts(const BundledFrame& frame) {
  std::vector<tracking::CameraCounts> counts;
  for (const frame::CameraFrame& c : frame.cameras) counts.push_back({static_cast<int>(c.keypoints.size()), 0, 0});
  return counts;
}

// One more for every camera that sees the feature.
void count_by_camera(const BundledFrame& frame, FeatureId feature, std::vector<int>& seen) {
  for (const frame::KeypointRef r : frame.bundled.keypoints(feature)) ++seen[r.camera.index()];
}

}  // namespace

Pipeline::Pipeline(const camera::Rig& rig, const Config& config, std::vector<image::Image> masks,
                   std::unique_ptr<looping::PlaceRecogniser> recogniser)
    : rig_(rig),
      config_(config),
      pool_(thread_count(config.execution.threads, rig.size())),
      monitor_(rig.size(), config.health),
      builder_(rig, config.features, std::move(masks)),
      recogniser_(std::move(recogniser)) {}

void Pipeline::restart() {
  state_ = {};
  candidate_.reset();
  early_.clear();
  feature_shares_.clear();
  error_floors_.clear();
  frames_lost_ = 0;
}

BundledFrame Pipeline::make_frame(const image::ImageBundle& images, std::vector<StageTime>& stages,
                                  std::span<const std::uint8_t> left_out) {
  const Stopwatch extraction;
  std::vector<std::uint8_t> failing = tracking::doubted(state_, rig_.size());
  for (std::size_t c = 0; c < failing.size(); ++c) failing[c] |= monitor_.failing()[c];
  const auto budgets = tracking::feature_budgets(rig_.size(), feature_shares_, left_out, failing, config_.features);
  BundledFrame frame = builder_.extract(images, pool_, left_out, budgets);
  for (frame::CameraFrame& c : frame.cameras) {
    if (!config_.tracking.own_times) c.time_ns = frame.time_ns;
  }
  if (state_.twist) frame.twist = *state_.twist;
  stages.push_back({"extract", extraction.ms()});
  const Stopwatch bundling;
  frame =
      matching::bundle(frame::rig_of(rig_, frame), frame, builder_.pyramids(), config_.bundling, alignment(), pool_);
  stages.push_back({"bundle", bundling.ms()});
  return frame;
}

std::vector<matching::AlignmentOptions> Pipeline::alignment() const {
  return tracking::alignment_by_camera(config_.tracking.alignment, error_floors_, rig_.size());
}

// Cameras that are out, and those that say nothing as long as the motion is unknown.
std::vector<std::uint8_t> Pipeline::left_out(const image::ImageBundle& images,
                                             const std::vector<tracking::Outage>& outages) const {
  std::vector<std::uint8_t> out(rig_.size());
  for (std::size_t c = 0; c < out.size(); ++c) out[c] = outages[c] != tracking::Outage::kNone;
  const bool motion_matters = config_.tracking.own_times && !state_.twist;
  return motion_matters ? frame::without_late_cameras(rig_, images, out) : out;
}

Pipeline::Outcome Pipeline::process(const image::ImageBundle& images, execution::StageExecutor& executor) {
  const Stopwatch whole;
  Outcome outcome;
  for (const image::CameraImage& i : images.images) outcome.record.images.push_back(i.state);
  outcome.record.outages = monitor_.judge(images);
  outcome.record.blurred = monitor_.blurred(images);
  trust_what_is_sharp_again(outcome.record.blurred);
  const std::vector<std::uint8_t> unused = left_out(images, outcome.record.outages);
  for (std::size_t c = 0; c < unused.size(); ++c) {
    outcome.record.waiting.push_back(unused[c] && outcome.record.outages[c] == tracking::Outage::kNone);
  }
  BundledFrame frame = make_frame(images, outcome.record.stages, unused);
  count_features(frame, outcome.record);
  const Stopwatch results;
  outcome.seen = executor.begin_frame(frame.id);
  grow_along(*outcome.seen);
  if (config_.mode == execution::Mode::kLagged) outcome.record.stages.push_back({"results", results.ms()});
  if (outcome.seen->num_keyframes() == 0) {
    start(std::move(frame), executor, outcome);
  } else {
    track(std::move(frame), executor, outcome);
  }
  const bool fresh = !outcome.keyframes.empty() || !state_.reference.valid();
  outcome.record.unit = unit_ = fresh ? 1.0 : outcome.seen->keyframe(state_.reference).unit;
  outcome.record.T_rig_odom = T_rig_odom_;
  outcome.record.T_map_odom = T_map_odom_;
  outcome.record.frame_ms = whole.ms();
  return outcome;
}

// A camera that saw nothing because it was blurred is doubted no longer.
void Pipeline::trust_what_is_sharp_again(const std::vector<std::uint8_t>& blurred) {
  for (std::size_t c = 0; c < blurred_.size() && c < state_.cameras.size(); ++c) {
    if (blurred_[c] && !blurred[c] && state_.cameras[c].doubted)
      state_.cameras[c] = tracking::trusted(state_.cameras[c].established);
  }
  blurred_ = blurred;
}

// The state is in the unit the map had: where its part was scaled since, it grows along.
void Pipeline::grow_along(const map::BundledMap& map) {
  if (!state_.reference.valid()) return;
  const double grown = map.keyframe(state_.reference).unit / unit_;
  state_.T_rig_reference = geometry::scaled(state_.T_rig_reference, grown);
  if (state_.twist) state_.twist->tail<3>() *= grown;
}

void Pipeline::start(BundledFrame frame, execution::StageExecutor& executor, Outcome& outcome) {
  const Stopwatch watch;
  tracking::TrackResult& result = outcome.record.result;
  result.frame = frame.id;
  result.time_ns = frame.time_ns;
  result.status = tracking::TrackStatus::kLost;
  result.reason = tracking::LostReason::kNotStarted;
  result.cameras = keypoint_counts(frame);
  map::MapDraft draft("start", outcome.seen);
  if (recogniser_) recogniser_->describe(frame);
  const auto& options = config_.tracking.initialisation;
  std::optional<tracking::StartedMap> started;
  if (rig_.any_overlap()) started = tracking::start_metric(frame, builder_.pyramids(), options, draft);
  const int patience = rig_.any_overlap() ? kMetricPatience : 0;
  const bool may = outcome.seen->num_keyframes() == 0 ||
                   outcome.seen->scale() != map::Scale::kMetric;  // one scale is said of all parts
  if (!started && may && candidate_ && frame.id.value() - candidate_->frame->id.value() >= patience) {
    const Random random(static_cast<std::uint64_t>(config_.seed), "start",
                        static_cast<std::uint64_t>(frame.id.value()));
    started = tracking::start_up_to_scale(*candidate_, frame, builder_.pyramids(), options, random, draft);
  }
  if (started) {
    draft.set_scale(started->scale, started->scale_deviation);
    const map::CommitReport report = executor.commit(execution::JournalStep::kStart, std::move(draft));
    const KeyframeId last = report.keyframes.back();
    state_ = tracking::state_at_keyframe(
        {}, frame.time_ns, last,
        committed(started->keyframes.back().landmarks, outcome.seen->landmark_slots(), report));
    const map::BundledKeyframe& keyframe = report.published->keyframe(last);
    std::vector<int> seen(rig_.size(), 0);
    for (std::size_t f = 0; f < keyframe.landmarks.size(); ++f) {
      if (keyframe.landmarks[f].valid()) count_by_camera(*keyframe.frame, FeatureId(f), seen);
    }
    state_.cameras =
        tracking::doubts_of(std::vector<tracking::CameraTrust>(rig_.size()), seen, config_.tracking.consensus);
    result.status = tracking::TrackStatus::kTracking;
    result.reason = tracking::LostReason::kNone;
    result.T_rig_world = keyframe.T_rig_world;
    result.reference = last;
    outcome.record.root = report.published->root_of(last);
    outcome.keyframes = report.keyframes;
    outcome.record.keyframe = true;
    outcome.began_part = true;
    if (report.keyframes.size() == 2) {
      const TimeNs before_ns = candidate_->frame->time_ns;
      for (auto& early : early_) {
        outcome.early.push_back({std::move(early), report.keyframes[0], report.keyframes[1], before_ns, frame.time_ns});
      }
    }
    early_.clear();
    candidate_.reset();
    frames_lost_ = 0;
    T_map_odom_ = result.T_rig_world.inverse() * T_rig_odom_;
  } else {
    keep_candidate(std::move(frame));
  }
  outcome.record.stages.push_back({"start", watch.ms()});
}

// The frame later ones are compared with is given up when it is old or its view is gone.
void Pipeline::keep_candidate(BundledFrame frame) {
  const auto& options = config_.tracking.initialisation;
  if (candidate_ && frame.num_keypoints() < static_cast<std::size_t>(options.min_monocular))
    return;  // nothing to go by
  const bool good = candidate_ && frame.id.value() - candidate_->frame->id.value() <= kMaxStartAge &&
                    tracking::comparable(*candidate_->frame, frame, options);
  const auto kept = std::make_shared<const BundledFrame>(std::move(frame));
  if (!good) {
    const auto pyramids = builder_.pyramids();
    candidate_ = tracking::StartCandidate{kept, {pyramids.begin(), pyramids.end()}};
    early_.clear();
  }
  early_.push_back(kept);
}

std::optional<tracking::TrackResult> Pipeline::locate_early(const map::BundledMap& map,
                                                            const tracking::BetweenKeyframes& early) {
  return tracking::pose_between(map, early, config_.feature_model(), config_.tracking, pool_);
}

tracking::TrackOutput Pipeline::follow(const BundledFrame& frame, const map::BundledMap& map) {
  if (!map.surviving(state_.reference).valid()) {  // no pose in this map so far
    const bool blind = frame.num_keypoints() < static_cast<std::size_t>(config_.tracking.min_inliers);
    return tracking::lost(state_, frame, blind ? tracking::LostReason::kFewFeatures : tracking::LostReason::kNotFound);
  }
  const auto alignment = this->alignment();
  const tracking::TrackInput input{.map = map,
                                   .pyramids = builder_.pyramids(),
                                   .alignment = alignment,
                                   .state = state_,
                                   .features = config_.feature_model(),
                                   .seed = static_cast<std::uint64_t>(config_.seed)};
  return tracking::track(input, frame, config_.tracking, pool_);
}

void Pipeline::track(BundledFrame frame, execution::StageExecutor& executor, Outcome& outcome) {
  const Stopwatch watch;
  const map::BundledMap& map = *outcome.seen;
  const tracking::TrackerState before = state_;
  tracking::TrackOutput output = follow(frame, map);
  outcome.record.stages.push_back({"track", watch.ms()});
  if (!is_tracking(output.result.status) && saw_something(output.result) && find_again(frame, map, outcome)) {
    output = follow(frame, map);
    if (!is_tracking(output.result.status)) outcome.record.relocalisation.reset();
  }
  if (is_tracking(output.result.status)) frame = output.frame;
  outcome.record.result = output.result;
  feature_shares_ = tracking::feature_shares(feature_shares_, map, frame, output);
  error_floors_ = tracking::error_floors(error_floors_, map, frame, output, config_.tracking.alignment);
  for (std::size_t c = 0; c < output.result.cameras.size(); ++c) {
    tracking::Outage& outage = outcome.record.outages[c];  // what the pictures say themselves explains more
    if (output.result.cameras[c].doubted && outage == tracking::Outage::kNone) outage = tracking::Outage::kInconsistent;
  }
  if (!is_tracking(output.result.status)) {
    state_ = before;
    state_.status = tracking::TrackStatus::kLost;
    state_.twist.reset();
    frames_lost_ += saw_something(output.result);
    note_motion(map, before, outcome.record);
    const bool anew = frames_lost_ >= config_.looping.recovery.new_part_after && !config_.localize_only;
    if (!anew || !saw_something(output.result)) return;
    start(std::move(frame), executor, outcome);
    if (!outcome.began_part) outcome.record.result = output.result;
    return;
  }
  frames_lost_ = 0;
  candidate_.reset();
  early_.clear();
  state_ = std::move(output.state);
  note_motion(map, before, outcome.record);
  if (config_.localize_only) {
    state_.sightings.clear();
  } else if (output.keyframe_due) {
    const Stopwatch keyframe_watch;
    add_keyframe(frame, output, executor, outcome);
    outcome.record.stages.push_back({"keyframe", keyframe_watch.ms()});
  }
}

// Looks for the place of a lost frame all over the map; true where the state is there now, for tracking to confirm.
bool Pipeline::find_again(BundledFrame& frame, const map::BundledMap& map, Outcome& outcome) {
  if (!recogniser_) return false;
  const Stopwatch watch;
  recogniser_->describe(frame);
  const Random random(static_cast<std::uint64_t>(config_.seed), "relocalise",
                      static_cast<std::uint64_t>(frame.id.value()));
  const auto location =
      looping::relocalise(*recogniser_, map, frame, config_.looping.verification, config_.feature_model(), random);
  outcome.record.stages.push_back({"relocalise", watch.ms()});
  if (!location) return false;
  std::vector<LandmarkId> landmarks;
  for (const auto& [feature, l] : location->matches) landmarks.push_back(l);
  std::sort(landmarks.begin(), landmarks.end());
  std::vector<int> seen(rig_.size(), 0);
  for (const auto& [feature, l] : location->matches) count_by_camera(frame, feature, seen);
  const auto trust = tracking::doubts_of(state_.cameras, seen, config_.tracking.consensus);
  state_ = tracking::state_at_keyframe({}, frame.time_ns, location->with, std::move(landmarks));
  state_.cameras = trust;
  state_.T_rig_reference = location->T_rig_world * map.keyframe(location->with).T_rig_world.inverse();
  outcome.record.relocalisation = Relocalisation{location->with, location->inliers};
  return true;
}

// What moved between the last frame and this one: the rig, or the map below it?
void Pipeline::note_motion(const map::BundledMap& map, const tracking::TrackerState& before, FrameRecord& record) {
  const bool continued = is_tracking(before.status) && map.surviving(before.reference).valid();
  if (continued) T_map_odom_ = (before.T_rig_reference * map.resolved_pose(before.reference)).inverse() * T_rig_odom_;
  if (is_tracking(record.result.status)) {
    if (continued && !record.relocalisation) {
      T_rig_odom_ = record.result.T_rig_world * T_map_odom_;
    } else {
      T_map_odom_ = record.result.T_rig_world.inverse() * T_rig_odom_;
    }
    record.root = map.root_of(record.result.reference);
  }
}

void Pipeline::add_keyframe(BundledFrame& frame, const tracking::TrackOutput& output,
                            execution::StageExecutor& executor, Outcome& outcome) {
  map::MapDraft draft("track", outcome.seen);
  draft.add_sightings(folded(std::move(state_.sightings)));
  if (recogniser_) recogniser_->describe(frame);
  const tracking::NewKeyframe made =
      tracking::make_keyframe(frame, output.matches, output.result.T_rig_world, builder_.pyramids(),
                              output.result.reference, config_.tracking.initialisation, draft);
  const map::CommitReport report = executor.commit(execution::JournalStep::kTrack, std::move(draft));
  const double grown =
      report.published->keyframe(output.result.reference).unit / outcome.seen->keyframe(output.result.reference).unit;
  if (state_.twist) state_.twist->tail<3>() *= grown;  // mapping may have found another scale meanwhile
  state_ = tracking::state_at_keyframe(state_, frame.time_ns, report.keyframes.front(),
                                       committed(made.landmarks, outcome.seen->landmark_slots(), report));
  outcome.record.result.reference = report.keyframes.front();
  outcome.record.result.T_rig_reference = geometry::SE3();
  outcome.record.keyframe = true;
  outcome.keyframes = report.keyframes;
}

}  // namespace bslam::system
