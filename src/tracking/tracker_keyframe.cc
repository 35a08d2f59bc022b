// Functions of tracking/tracker.h that create keyframes: of the current frame, or later of a frame that was tracked
// directly.
#include <algorithm>
#include <utility>

#include "base/stopwatch.h"
#include "map/keyframe_landmarks.h"
#include "tracking/feature_budget.h"
#include "tracking/make_keyframe.h"
#include "tracking/stereo_scale.h"
#include "tracking/tracker.h"

namespace bslam::tracking {
namespace {

// The keyframe that was created from the pending frame; invalid if the map has none.
KeyframeId keyframe_of(const map::BundledMap& map, const PendingKeyframe& pending) {
  for (std::size_t k = pending.first_keyframe; k < map.keyframe_slots(); ++k) {
    const KeyframeId id(k);
    if (map.alive(id) && map.keyframe(id).frame->id == pending.frame) return id;
  }
  return {};
}

}  // namespace

void FrontEndState::forget_pending() {
  pending.reset();
  track.pending_counts.clear();
}

void Tracker::propose_keyframe(Input& input, const TrackOutput& output, TrackOutcome& outcome) const {
  const Stopwatch watch;
  map::MapDraft draft(input.map);
  draft.add_visibility_counts(std::move(outcome.next.track.visibility_counts));
  if (relocaliser_) relocaliser_->describe(input.frame);
  input.frame.stereo_scale = stereo_scale(*input.map, input.frame, output.matches, output.result.T_rig_world,
                                          options_.tracking.initialisation);
  NewKeyframe made = make_keyframe(input.frame, output.matches, output.result.T_rig_world, input.pyramids,
                                   output.result.anchored.reference, options_.tracking.initialisation, draft);
  outcome.edit = ProposedEdit{ProposedEdit::Kind::kKeyframe, std::move(draft), std::move(made.landmarks),
                              input.map->landmark_slots()};
  outcome.record.stages.push_back({"keyframe", watch.ms()});
}

void Tracker::complete_keyframe(const map::CommitReport& report, TrackOutcome& outcome) const {
  TrackerState& state = outcome.next.track;
  TrackResult& result = outcome.record.result;
  // Mapping may have committed a new scale while the frame was tracked. The record keeps that of its pose.
  if (state.twist) state.twist = geometry::scaled(*state.twist, result.anchored.scale_change(*report.published));
  state = state_at_keyframe(state, result.time_ns, *report.published, report.keyframes.front(),
                            committed_landmarks(outcome.edit->landmarks, outcome.edit->base_landmarks, report));
  result.anchored = state.anchored;
}

// Marks the frame as pending unless another one is: its features are extracted later.
void Tracker::want_keyframe(const map::BundledMap& map, TrackOutcome& outcome) const {
  FrontEndState& state = outcome.next;
  if (state.pending) return;
  outcome.keyframe_wanted = true;
  state.pending = {outcome.record.result.frame, state.track.anchored, map.keyframe_slots(), state.planned_ns};
  // The keyframe adds them; they are lost if its features give no pose.
  state.track.pending_counts = std::exchange(state.track.visibility_counts, {});
}

std::optional<TrackOutcome> Tracker::create_keyframe(KeyframeRequest request, std::span<const image::Pyramid> pyramids,
                                                     const map::MapSnapshot& map) const {
  const auto T_rig_world = request.pose.resolve(*map);
  if (!T_rig_world) return std::nullopt;
  TrackOutcome outcome;
  outcome.next = std::move(request.before);
  FrontEndState& state = outcome.next;
  apply_scale_change(*map, state.track);
  Input input{std::move(request.frame), pyramids, map};
  TrackOutput output = follow(input, state, EstimatedPose{*T_rig_world});
  if (output.result.status != TrackStatus::kTracking) return std::nullopt;
  input.frame = output.frame;  // refined by tracking
  outcome.record.result = output.result;
  state.budget_fractions = budget_fractions(state.budget_fractions, *map, input.frame, output);
  state.track = std::move(output.state);
  propose_keyframe(input, output, outcome);
  return outcome;
}

std::optional<CreatedKeyframe> Tracker::adopt_keyframe(const map::BundledMap& map, FrontEndState& state) const {
  if (!state.pending) return std::nullopt;
  const KeyframeId keyframe = keyframe_of(map, *state.pending);
  if (!keyframe.valid()) {
    const double waited_s = to_seconds(state.planned_ns - state.pending->time_ns);
    state.keyframe_failed = ++state.pending->frames > kMaxPendingFrames && waited_s > kMaxPending_s;
    if (state.keyframe_failed) state.forget_pending();
    return std::nullopt;
  }
  const PendingKeyframe pending = *state.pending;
  state.forget_pending();
  TrackerState& track = state.track;
  apply_scale_change(map, track);
  const auto T_rig_world = track.anchored.resolve(map), T_then_world = pending.pose.resolve(map);
  const CreatedKeyframe created{pending.frame, keyframe};
  if (!T_rig_world || !T_then_world || map.root_of(track.anchored.reference) != map.root_of(keyframe)) return created;
  // The motion since the frame comes from direct tracking, the pose of the keyframe from its features.
  const geometry::SE3 T_rig_keyframe = *T_rig_world * T_then_world->inverse();
  std::vector<LandmarkId> landmarks = map::landmarks_of(map, keyframe);
  std::vector<map::VisibilityCount> counts = std::move(track.visibility_counts);
  track = state_at_keyframe(track, track.time_ns, map, keyframe, std::move(landmarks));
  track.anchored = map::AnchoredPose::at(map, keyframe, T_rig_keyframe * map.keyframe(keyframe).T_rig_world);
  for (CameraReference& r : track.references) {
    if (r.keyframe == keyframe) r.frames = pending.frames;
  }
  track.visibility_counts = std::move(counts);
  return created;
}

std::vector<LandmarkId> committed_landmarks(const std::vector<LandmarkId>& proposed, std::size_t base_landmarks,
                                            const map::CommitReport& report) {
  std::vector<LandmarkId> out;
  for (const LandmarkId l : proposed) {
    const LandmarkId id =
        l.index() < base_landmarks ? report.published->resolve(l) : report.landmarks[l.index() - base_landmarks];
    if (report.published->alive(id)) out.push_back(id);
  }
  std::sort(out.begin(), out.end());
  out.erase(std::unique(out.begin(), out.end()), out.end());
  return out;
}

}  // namespace bslam::tracking
