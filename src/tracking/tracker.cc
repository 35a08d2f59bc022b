#include "tracking/tracker.h"

#include <algorithm>
#include <utility>

#include "base/stopwatch.h"
#include "frame/capture_times.h"
#include "tracking/calibration_error.h"
#include "tracking/feature_budget.h"
#include "tracking/motion_prediction.h"

namespace bslam::tracking {
namespace {

using frame::BundledFrame;

bool is_tracking(TrackStatus status) { return status == TrackStatus::kTracking; }

// Returns true if there were enough features for a pose.
bool had_features(const TrackResult& result) {
  return result.reason != LostReason::kNoImages && result.reason != LostReason::kFewFeatures;
}

// Readmits cameras that were excluded while they were blurred and are sharp now.
void readmit_sharp_cameras(const std::vector<std::uint8_t>& blurred, FrontEndState& state) {
  for (std::size_t c = 0; c < state.blurred.size() && c < state.track.cameras.size(); ++c) {
    CameraConsensusState& camera = state.track.cameras[c];
    if (state.blurred[c] && !blurred[c] && camera.excluded) camera = readmitted(camera.established);
  }
  state.blurred = blurred;
}

// Counts for how long each camera has not been used while others were.
void count_unused(TimeNs time_ns, const std::vector<std::uint8_t>& out, FrontEndState& state) {
  const TimeNs passed_ns = state.unused_ns.empty() ? 0 : time_ns - state.planned_ns;
  state.planned_ns = time_ns;
  state.unused_ns.resize(out.size(), 0);
  if (std::ranges::find(out, std::uint8_t{0}) == out.end()) return;
  for (std::size_t c = 0; c < out.size(); ++c) state.unused_ns[c] = out[c] ? state.unused_ns[c] + passed_ns : 0;
}

// Attributes the change of the pose since the last frame to the motion of the rig (T_rig_odom) if tracking was
// continuous, else to T_map_odom. Corrections of the map since the last frame change T_map_odom.
void update_odometry(const map::BundledMap& map, const TrackerState& before, TrackOutcome& outcome) {
  FrontEndState& state = outcome.next;
  FrameRecord& record = outcome.record;
  const bool continued = is_tracking(before.status) && before.anchored.known_in(map);
  if (continued) state.T_map_odom = before.anchored.resolve(map)->inverse() * state.T_rig_odom;
  if (!is_tracking(record.result.status)) return;
  if (continued && !record.relocalisation) {
    state.T_rig_odom = record.result.T_rig_world * state.T_map_odom;
  } else {
    state.T_map_odom = record.result.T_rig_world.inverse() * state.T_rig_odom;
  }
  record.root = map.root_of(record.result.anchored.reference);
}

// After a few failures in a row, the next frames are tracked with features.
void pause_direct_tracking(DirectFailure failure, FrontEndState& state) {
  constexpr int kFailures = 3, kPause = 10;
  if (state.direct_pause > 0) --state.direct_pause;
  if (failure == DirectFailure::kFewInliers || failure == DirectFailure::kKeyframeDue ||
      failure == DirectFailure::kDoubtful)
    state.direct_failures = 0;
  if (failure != DirectFailure::kNoPose) return;
  if (++state.direct_failures >= kFailures) state.direct_pause = kPause;
}

void count_features(const BundledFrame& frame, FrameRecord& record) {
  record.unique = static_cast<int>(frame.bundled.size());
  record.matched = static_cast<int>(frame.bundled.num_matched());
  record.monocular = static_cast<int>(frame.bundled.num_monocular());
}

std::optional<EstimatedPose> estimate_of(const DirectAttempt& direct) {
  if (!direct.outcome || direct.failure == DirectFailure::kDoubtful) return std::nullopt;
  const TrackResult& result = direct.outcome->record.result;
  EstimatedPose out{result.T_rig_world, direct.all_cameras};
  for (const CameraCounts& camera : result.cameras) out.aligned.push_back({camera.keypoints, camera.inliers});
  return out;
}

// The options with the number of cameras of the run.
TrackerOptions of_rig(TrackerOptions options, const camera::Rig& rig) {
  if (options.num_cameras == 0) options.num_cameras = rig.size();
  return options;
}

// Copies the motion from the state to the record.
void record_motion(TrackOutcome& outcome) {
  if (is_tracking(outcome.record.result.status)) outcome.record.twist = outcome.next.track.twist;
  outcome.record.T_rig_odom = outcome.next.T_rig_odom;
  outcome.record.T_map_odom = outcome.next.T_map_odom;
}

}  // namespace

FrontEndState FrontEndState::restarted() const {
  FrontEndState state;
  state.blurred = blurred;
  state.planned_ns = planned_ns;
  state.unused_ns = unused_ns;
  state.used = used;
  state.incomplete_ns = incomplete_ns;
  state.reduction = reduction;
  state.rig_corrections = rig_corrections;
  state.T_rig_odom = T_rig_odom;
  state.T_map_odom = T_map_odom;
  return state;
}

Tracker::Tracker(const camera::Rig& rig, const TrackerOptions& options, ThreadPool& pool,
                 std::unique_ptr<Relocaliser> relocaliser)
    : rig_(rig), options_(of_rig(options, rig)), pool_(pool), relocaliser_(std::move(relocaliser)) {
  for (std::size_t i = 0; i < levels_.size(); ++i) {
    const int level = static_cast<int>(i);
    levels_[i] = {reduced(options.features, level), reduced(options.tracking, level)};
  }
}

std::vector<matching::AlignmentOptions> Tracker::alignment(const FrontEndState& state) const {
  return alignment_by_camera(options_.tracking.alignment, state.calibration_errors, rig_.size());
}

FramePlan Tracker::plan(const image::ImageBundle& images, const ImageFaults& faults, FrontEndState& state) const {
  readmit_sharp_cameras(faults.blurred, state);
  FramePlan plan;
  std::vector<std::uint8_t> out(rig_.size());
  for (std::size_t c = 0; c < out.size(); ++c) out[c] = faults.outage[c] != CameraReason::kNone;
  count_unused(images.time_ns, out, state);
  const std::vector<std::uint8_t> gone = gone_cameras(state);
  state.used.resize(out.size(), 0);
  for (std::size_t c = 0; c < out.size(); ++c) {
    if (!out[c]) state.used[c] = 1;
    if (out[c] && state.used[c] && !gone[c]) state.incomplete_ns = images.time_ns;
  }
  const bool recent = to_seconds(images.time_ns - state.track.time_ns) <= kMaxPrediction_s;
  const bool still = state.at_rest && !state.waiting.empty() &&
                     to_seconds(images.time_ns - state.waiting.back()->time_ns) <= kMaxPrediction_s;
  const bool motion_known = (state.track.twist && recent) || still;
  const bool motion_matters = options_.tracking.use_capture_times && !motion_known;
  plan.skipped = motion_matters ? frame::without_late_cameras(rig_, images, out) : out;
  for (std::size_t c = 0; c < out.size(); ++c) plan.postponed.push_back(plan.skipped[c] && !out[c]);
  std::vector<std::uint8_t> failing = excluded(state.track, rig_.size());
  for (std::size_t c = 0; c < failing.size(); ++c) failing[c] |= faults.failing[c];
  plan.budgets = budgets(state, plan.skipped, failing);
  plan.alignment = alignment(state);
  plan.motion_unknown = motion_matters;
  if (state.track.twist && recent) plan.twist = *state.track.twist;
  return plan;
}

// Per camera of the rig; the budget of the rig is divided among the cameras of the run.
std::vector<int> Tracker::budgets(const FrontEndState& state, std::span<const std::uint8_t> skipped,
                                  std::span<const std::uint8_t> failing) const {
  const std::size_t first = options_.first_camera, n = options_.num_cameras;
  const auto of_run = [&](auto values) { return values.empty() ? values : values.subspan(first, n); };
  const std::span<const double> fractions = state.budget_fractions;
  const std::vector<int> found =
      feature_budgets(n, of_run(fractions), of_run(skipped), of_run(failing), level_of(state).features);
  std::vector<int> out(rig_.size(), 0);
  std::ranges::copy(found, out.begin() + static_cast<std::ptrdiff_t>(first));
  return out;
}

void Tracker::note_repetition(bool repeated, TimeNs time_ns, const map::BundledMap& map, FrontEndState& state) const {
  constexpr double kVisible_px = 1.0;
  constexpr double kAtRest_px = 0.1;  // between two frames; less is noise
  if (!repeated) {
    state.stalled = false;
    state.new_images_ns = time_ns;
    state.speed_before_px_s.reset();
    return;
  }
  if (!state.speed_before_px_s) {
    const double moved = is_tracking(state.track.status) ? image_motion_px(map, state.track) : 0.0;
    state.speed_before_px_s = moved > kAtRest_px ? moved / state.track.twist_interval_s : 0.0;
  }
  state.stalled |= *state.speed_before_px_s * to_seconds(time_ns - state.new_images_ns) > kVisible_px;
}

bool Tracker::tracks_directly(const FrontEndState& state) const {
  const FrontEnd front_end = options_.tracking.frontend;
  if (front_end == FrontEnd::kFeatures || (front_end == FrontEnd::kAuto && state.direct_pause > 0)) return false;
  return is_tracking(state.track.status) && state.track.twist &&
         std::ranges::none_of(state.track.cameras, &CameraConsensusState::excluded);
}

TrackInput Tracker::input_of(const map::BundledMap& map, std::span<const image::Pyramid> pyramids,
                             std::span<const matching::AlignmentOptions> alignment, const FrontEndState& state) const {
  return {.map = map,
          .pyramids = pyramids,
          .alignment = alignment,
          .state = state.track,
          .features = options_.features.model(),
          .seed = options_.seed};
}

DirectAttempt Tracker::process_directly(const FrontEndState& state, const BundledFrame& frame,
                                        const FrameImages& images, const map::MapSnapshot& map) const {
  const Stopwatch watch;
  TrackOutcome outcome;
  outcome.next = state;
  TrackerState& track = outcome.next.track;
  apply_scale_change(*map, track);
  const auto alignment = this->alignment(state);
  TrackInput input = input_of(*map, images.pyramids, alignment, outcome.next);
  input.masks = images.masks;
  DirectOutput direct = track_directly(input, frame, level_of(state).tracking, pool_);
  if (direct.failure == DirectFailure::kKeyframeDue && options_.localize_only)
    direct.failure = direct.all_cameras ? DirectFailure::kNone : DirectFailure::kFewInliers;
  if (!direct.output) return {.failure = direct.failure};
  TrackOutput& output = *direct.output;
  const TrackerState before = std::exchange(track, std::move(output.state));
  outcome.next.direct_failures = 0;
  outcome.record.result = output.result;
  outcome.record.direct = true;
  count_features(output.frame, outcome.record);
  outcome.next.calibration_errors =
      calibration_errors(state.calibration_errors, *map, output.frame, output, options_.tracking.alignment);
  if (options_.localize_only) track.visibility_counts.clear();
  update_odometry(*map, before, outcome);
  record_motion(outcome);
  if (direct.failure == DirectFailure::kKeyframeDue && direct.all_cameras && !state.keyframe_failed) {
    direct.failure = DirectFailure::kNone;
    want_keyframe(*map, outcome);
  }
  outcome.observed = observed_keypoints(output.frame, std::move(output.matched), std::move(output.matches));
  outcome.record.stages.push_back({"align", watch.ms()});
  return {direct.failure, std::move(outcome), direct.all_cameras};
}

TrackOutcome Tracker::process(FrontEndState state, BundledFrame frame, std::span<const image::Pyramid> pyramids,
                              const map::MapSnapshot& map, DirectAttempt direct) {
  TrackOutcome outcome;
  outcome.next = std::move(state);
  outcome.observed = observed_keypoints(frame);
  count_features(frame, outcome.record);
  apply_scale_change(*map, outcome.next.track);
  pause_direct_tracking(direct.failure, outcome.next);
  outcome.next.keyframe_failed = false;
  Input input{std::move(frame), pyramids, map, std::move(direct)};
  if (map->num_keyframes() == 0) {
    start(input, outcome);
  } else {
    track(input, outcome);
  }
  record_motion(outcome);
  return outcome;
}

void Tracker::committed(const map::CommitReport& report, TrackOutcome& outcome) const {
  outcome.record.keyframe = true;
  if (outcome.edit->kind == ProposedEdit::Kind::kKeyframe) return complete_keyframe(report, outcome);
  complete_start(report, outcome);
  record_motion(outcome);
}

std::optional<TrackResult> Tracker::locate_early(const map::BundledMap& map, const BetweenKeyframes& early) const {
  return pose_between(map, early, options_.features.model(), options_.tracking, pool_);
}

TrackOutput Tracker::follow(const Input& input, const FrontEndState& state,
                            const std::optional<EstimatedPose>& estimate) const {
  if (!state.track.anchored.known_in(*input.map)) {  // no pose in this map yet
    const bool blind = input.frame.num_keypoints() < static_cast<std::size_t>(options_.tracking.min_inliers);
    return lost(state.track, input.frame, blind ? LostReason::kFewFeatures : LostReason::kNotFound);
  }
  const auto alignment = this->alignment(state);
  TrackInput track_input = input_of(*input.map, input.pyramids, alignment, state);
  track_input.estimate = estimate;
  return tracking::track(track_input, input.frame, level_of(state).tracking, pool_);
}

void Tracker::track(Input& input, TrackOutcome& outcome) {
  const Stopwatch watch;
  FrontEndState& state = outcome.next;
  FrameRecord& record = outcome.record;
  const TrackerState before = state.track;
  TrackOutput output = follow(input, state, estimate_of(input.direct));
  record.stages.push_back({"track", watch.ms()});
  if (!is_tracking(output.result.status) && keep_direct_pose(input, outcome)) return;
  if (!is_tracking(output.result.status) && had_features(output.result) && relocalise(input, outcome)) {
    output = follow(input, state, std::nullopt);
    if (!is_tracking(output.result.status)) record.relocalisation.reset();
  }
  if (is_tracking(output.result.status)) input.frame = output.frame;  // refined by tracking
  record.result = output.result;
  state.budget_fractions = budget_fractions(state.budget_fractions, *input.map, input.frame, output);
  state.calibration_errors =
      calibration_errors(state.calibration_errors, *input.map, input.frame, output, options_.tracking.alignment);
  if (!is_tracking(output.result.status)) return handle_lost(input, before, outcome);
  state.frames_lost = state.direct_kept = 0;
  restart_monocular_start(state);
  state.track = std::move(output.state);
  update_odometry(*input.map, before, outcome);
  if (options_.localize_only) {
    state.track.visibility_counts.clear();
  } else if (output.keyframe_due ||
             (input.direct.failure == DirectFailure::kKeyframeDue && !output.at_similar_keyframe)) {
    state.forget_pending();
    propose_keyframe(input, output, outcome);
  }
  outcome.observed = observed_keypoints(output.frame, std::move(output.matched), std::move(output.matches));
}

// If the features of the frame give no pose but direct tracking has found one, that pose is kept. It is not kept if
// this has already happened in several frames in a row, because then the features are better evidence. Returns true if
// it is kept.
bool Tracker::keep_direct_pose(const Input& input, TrackOutcome& outcome) const {
  constexpr int kMaxKept = 5;
  if (!input.direct.outcome || outcome.next.direct_kept >= kMaxKept) return false;
  if (input.direct.failure == DirectFailure::kDoubtful) return false;
  std::vector<StageTime> stages = std::move(outcome.record.stages);
  const int kept = outcome.next.direct_kept + 1;
  outcome = *input.direct.outcome;
  outcome.next.direct_kept = kept;
  outcome.record.stages = std::move(stages);
  return true;
}

bool Tracker::gives_up(const FrontEndState& state, TimeNs time_ns) const {
  constexpr int kFew = 5;             // minimum number of frames in which the map is searched
  constexpr double kFastest = 0.025;  // s; at a higher rate, the time counts instead of the number of frames
  const double lost_s = to_seconds(time_ns - state.lost_since_ns);
  const int needed = options_.new_submap_after;
  return (state.frames_lost >= needed && lost_s >= kFastest * (needed - 1)) ||
         (state.frames_lost >= kFew && lost_s >= options_.new_submap_after_s);
}

// The next frames search for the rig where its last motion would have taken it, or near its last pose if that is too
// long ago. After too many lost frames a new submap is started. A short time without images is no reason to search
// elsewhere, and the next frame may still become the one that follows a pending keyframe.
void Tracker::handle_lost(Input& input, const TrackerState& before, TrackOutcome& outcome) {
  FrontEndState& state = outcome.next;
  const TrackResult result = outcome.record.result;
  state.track = before;
  const bool recent = to_seconds(result.time_ns - before.time_ns) <= kMaxPrediction_s;
  if (result.reason != LostReason::kNoImages || !recent) {
    state.track.status = TrackStatus::kLost;
    state.forget_pending();
  }
  update_odometry(*input.map, before, outcome);
  if (!had_features(result)) return;
  if (state.frames_lost++ == 0) state.lost_since_ns = result.time_ns;
  if (options_.localize_only || !gives_up(state, result.time_ns)) return;
  start(input, outcome);
  if (!outcome.edit) outcome.record.result = result;
}

// Returns true if a place was found. The state is then set to its pose, which tracking has to confirm.
bool Tracker::relocalise(Input& input, TrackOutcome& outcome) {
  if (!relocaliser_) return false;
  const Stopwatch watch;
  relocaliser_->describe(input.frame);
  const auto plausible = [&](const FoundPlace& place) {
    return is_plausible(place, *input.map, outcome.next.track, input.frame.time_ns);
  };
  const std::optional<FoundPlace> place = relocaliser_->verify_place(*input.map, input.frame, plausible);
  outcome.record.stages.push_back({"relocalise", watch.ms()});
  if (!place) return false;
  std::vector<LandmarkId> landmarks;
  std::vector<int> seen(rig_.size(), 0);
  for (const auto& [feature, l] : place->matches) {
    landmarks.push_back(l);
    for (const frame::KeypointRef r : input.frame.bundled.keypoints(feature)) ++seen[r.camera.index()];
  }
  std::sort(landmarks.begin(), landmarks.end());
  TrackerState& state = outcome.next.track;
  auto cameras = readmit_observing_cameras(state.cameras, seen, options_.tracking.consensus);
  TrackerState fresh;
  fresh.cameras = std::move(cameras);
  fresh.stamps = std::move(state.stamps);
  state = state_at_keyframe(fresh, input.frame.time_ns, *input.map, place->matched_keyframe, std::move(landmarks));
  state.anchored = map::AnchoredPose::at(*input.map, place->matched_keyframe, place->T_rig_world);
  outcome.next.forget_pending();
  outcome.record.relocalisation = Relocalisation{place->matched_keyframe, place->inliers};
  return true;
}

}  // namespace bslam::tracking
