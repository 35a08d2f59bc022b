// Initialisation of a map by the tracker, if there is no map or the rig cannot be located in it.
#include "base/stopwatch.h"
#include "frame/capture_times.h"
#include "map/keyframe_landmarks.h"
#include "matching/bundling.h"
#include "tracking/late_cameras.h"
#include "tracking/start_correction.h"
#include "tracking/tracker.h"

namespace bslam::tracking {
namespace {

using frame::BundledFrame;

constexpr int kMetricAttempts = 5;  // frames in which only metric initialisation is attempted if cameras overlap
constexpr int kScaleAttempts = 20;  // frames in which the scale has to be found if they never capture together
// Maximum age of the reference frame of a monocular initialisation, if both are exceeded.
constexpr int kMaxStartAge = 100;  // frames
constexpr double kMaxStartAge_s = 10;
constexpr double kGone_s = 2.0;           // a camera without images for longer is not in use any more
constexpr std::size_t kMaxWaiting = 100;  // frames since the reference frame; of the later ones, every tenth is kept

TrackResult not_started(const BundledFrame& frame) {
  TrackResult result;
  result.frame = frame.id;
  result.time_ns = frame.time_ns;
  result.status = TrackStatus::kLost;
  result.reason = LostReason::kNotStarted;
  for (const frame::CameraFrame& c : frame.cameras)
    result.cameras.push_back({static_cast<int>(c.keypoints.size()), 0, 0});
  return result;
}

bool too_old(const BundledFrame& reference, const BundledFrame& frame) {
  return frame.id.value() - reference.id.value() > kMaxStartAge &&
         to_seconds(frame.time_ns - reference.time_ns) > kMaxStartAge_s;
}

// Returns true if the frame has enough keypoints of a camera of which no reference frame has any.
bool has_other_cameras(const BundledFrame& frame, std::span<const StartReference> references,
                       std::size_t min_keypoints) {
  for (std::size_t c = 0; c < frame.cameras.size(); ++c) {
    const auto has_keypoints = [c](const StartReference& r) {
      return !r.candidate->frame->cameras[c].keypoints.empty();
    };
    if (frame.cameras[c].keypoints.size() >= min_keypoints && std::ranges::none_of(references, has_keypoints))
      return true;
  }
  return false;
}

// Returns true if both frames have keypoints, but no camera has keypoints in both of them.
bool from_other_cameras(const BundledFrame& a, const BundledFrame& b) {
  for (std::size_t c = 0; c < a.cameras.size(); ++c) {
    if (!a.cameras[c].keypoints.empty() && !b.cameras[c].keypoints.empty()) return false;
  }
  return a.num_keypoints() > 0 && b.num_keypoints() > 0;
}

// Returns true if two cameras that are not gone share a view and capture together, as far as the frames show.
bool views_in_common(const camera::Rig& rig, std::span<const std::uint8_t> gone, const BundledFrame& frame,
                     std::span<const std::shared_ptr<const BundledFrame>> before) {
  const auto apart = [&](std::size_t i, std::size_t j) {
    const CameraIndex a(i), b(j);
    return frame::captured_apart(frame, a, b) ||
           std::ranges::any_of(before, [&](const auto& f) { return frame::captured_apart(*f, a, b); });
  };
  for (std::size_t i = 0; i < rig.size(); ++i) {
    for (std::size_t j = i + 1; j < rig.size(); ++j) {
      if (!gone[i] && !gone[j] && rig.share_view(i, j) && !apart(i, j)) return true;
    }
  }
  return false;
}

// The frame was matched as if the rig rested, but it has begun to move.
void forget_matches(const camera::Rig& rig, BundledFrame& frame) {
  frame.bundled = matching::make_bundled(rig, frame.cameras, {}, 0.0, 0.0);
  frame.motion_unknown = true;
}

}  // namespace

void Tracker::start(Input& input, TrackOutcome& outcome) const {
  const Stopwatch watch;
  outcome.record.result = not_started(input.frame);
  FrontEndState& state = outcome.next;
  ++state.start_attempts;
  const bool rested =
      std::exchange(state.at_rest, !state.waiting.empty() && at_rest(*state.waiting.back(), input.frame));
  if (rested && !state.at_rest) forget_matches(rig_, input.frame);
  if (correct_rig(input, outcome)) {
    outcome.record.stages.push_back({"start", watch.ms()});
    return;
  }
  map::MapDraft draft(input.map);
  if (relocaliser_) relocaliser_->describe(input.frame);
  if (std::optional<StartedMap> started = initialise(input, outcome.next, draft)) {
    // The first submap declares for the whole map whether its scale is metric. If it is not, each submap has its own
    // arbitrary unit of length. A metric map remains so only with submaps that are metric. Mapping may declare it
    // metric before this submap is committed, which a submap of arbitrary unit withdraws.
    const bool metric = started->scale == map::Scale::kMetric;
    if (input.map->num_keyframes() == 0 || (!metric && input.map->scale() == map::Scale::kMetric))
      draft.set_scale(started->scale, started->scale_deviation);
    else if (!metric)
      draft.set_scale(input.map->scale(), input.map->scale_deviation());
    outcome.edit = ProposedEdit{ProposedEdit::Kind::kStart, std::move(draft),
                                std::move(started->keyframes.back().landmarks), input.map->landmark_slots()};
  } else {
    keep_reference_frame(input, outcome.next);
  }
  outcome.record.stages.push_back({"start", watch.ms()});
}

std::optional<StartedMap> Tracker::initialise(const Input& input, const FrontEndState& state,
                                              map::MapDraft& draft) const {
  InitialisationOptions options = options_.tracking.initialisation;
  // If cameras lose images, the next frame may show only some of the landmarks.
  const bool loses_images = state.incomplete_ns && to_seconds(input.frame.time_ns - *state.incomplete_ns) <= kGone_s;
  if (loses_images) options.min_matched = std::max(options.min_matched, 2 * options_.tracking.min_inliers);
  const std::vector<std::uint8_t> gone = gone_cameras(state);
  const bool overlap = rig_.any_overlap(gone);
  if (overlap) {
    if (auto started = initialise_metric(input.frame, input.pyramids, options, draft)) return started;
  }
  const bool together = views_in_common(rig_, gone, input.frame, state.waiting);
  // The scale is a property of the whole map. Overlapping cameras will start a metric submap sooner or later, and one
  // camera alone never does.
  const bool metric = input.map->num_keyframes() > 0 && input.map->scale() == map::Scale::kMetric;
  const bool single = std::ranges::count(gone, std::uint8_t{0}) <= 1;
  if (metric && (together || single)) return std::nullopt;
  const int metric_attempts = together ? kMetricAttempts : 0;
  if (state.start_references.empty()) return std::nullopt;
  const auto age = input.frame.id.value() - state.start_references.front().candidate->frame->id.value();
  if (age < metric_attempts) return std::nullopt;
  const bool scale_needed = overlap && !together && (metric || state.start_attempts <= kScaleAttempts);
  const Random random(options_.seed, "start", static_cast<std::uint64_t>(input.frame.id.value()));
  for (const StartReference& reference : state.start_references) {
    const StartCandidate& first = *reference.candidate;
    const StartFrames frames{first, input.frame, input.pyramids, state.waiting, scale_needed};
    if (auto started = initialise_monocular(frames, options, random, draft)) return started;
  }
  return std::nullopt;
}

// Per camera of the rig: whether it belongs to another rig of the map, or has not been used for long.
std::vector<std::uint8_t> Tracker::gone_cameras(const FrontEndState& state) const {
  const std::size_t first = options_.first_camera, n = options_.num_cameras;
  std::vector<std::uint8_t> out(rig_.size(), 1);
  for (std::size_t c = first; c < first + n; ++c)
    out[c] = c < state.unused_ns.size() && to_seconds(state.unused_ns[c]) > kGone_s;
  return out;
}

// Proposes a correction of the rig if the frame shows that one is needed. The caller commits it and processes the frame
// again.
bool Tracker::correct_rig(const Input& input, TrackOutcome& outcome) const {
  constexpr int kMaxCorrections = 2, kCheckInterval = 5;  // frames
  FrontEndState& state = outcome.next;
  if (!options_.correct_rig || input.map->num_keyframes() > 0 || !rig_.any_overlap()) return false;
  if (state.rig_corrections >= kMaxCorrections || state.rig_checks++ % kCheckInterval != 0) return false;
  auto corrected = with_corrected_pairs(input.map->rig(), rig_, options_.sigma_focal, input.frame);
  if (!corrected) return false;
  ++state.rig_corrections;
  map::MapDraft draft(input.map);
  draft.set_rig(*std::move(corrected));
  outcome.edit = ProposedEdit{ProposedEdit::Kind::kRig, std::move(draft), {}, 0};
  restart_monocular_start(state);
  return true;
}

void Tracker::restart_monocular_start(FrontEndState& state) {
  state.start_references.clear();
  state.waiting.clear();
  state.at_rest = false;
  state.start_attempts = 0;
}

// Stores the frame. Reference frames that are too old or have too few matches with it are removed. A frame of other
// cameras cannot be matched with a reference frame and does not remove it, unless there is no other kind any more. The
// frame becomes a reference frame if it has keypoints of a camera of which no other one has.
void Tracker::keep_reference_frame(Input& input, FrontEndState& state) const {
  const InitialisationOptions& options = options_.tracking.initialisation;
  std::vector<StartReference>& references = state.start_references;
  if (!references.empty() && input.frame.num_keypoints() < static_cast<std::size_t>(options.min_monocular))
    return;  // too few keypoints to compare
  std::erase_if(references, [&](StartReference& reference) {
    const BundledFrame& first = *reference.candidate->frame;
    const bool others = from_other_cameras(first, input.frame);
    reference.frames_of_others = others ? reference.frames_of_others + 1 : 0;
    if (others) return reference.frames_of_others >= static_cast<int>(rig_.size());
    return too_old(first, input.frame) || !comparable(first, input.frame, options);
  });
  const auto kept = std::make_shared<const BundledFrame>(std::move(input.frame));
  if (references.empty() || has_other_cameras(*kept, references, static_cast<std::size_t>(options.min_monocular))) {
    const StartCandidate candidate{kept, {input.pyramids.begin(), input.pyramids.end()}};
    references.push_back({std::make_shared<const StartCandidate>(candidate)});
  }
  const FrameId oldest = references.front().candidate->frame->id;
  std::erase_if(state.waiting, [&](const auto& frame) { return frame->id < oldest; });
  if (state.waiting.size() < kMaxWaiting || kept->id.value() % 10 == 0) state.waiting.push_back(kept);
}

void Tracker::complete_start(const map::CommitReport& report, TrackOutcome& outcome) const {
  FrontEndState& state = outcome.next;
  TrackResult& result = outcome.record.result;
  const KeyframeId last = report.keyframes.back();
  const map::BundledKeyframe& keyframe = report.published->keyframe(last);
  TrackerState fresh;
  fresh.cameras = readmit_observing_cameras(std::vector<CameraConsensusState>(rig_.size()),
                                            map::landmarks_by_camera(keyframe), options_.tracking.consensus);
  fresh.stamps = std::move(state.track.stamps);
  state.track = state_at_keyframe(fresh, result.time_ns, *report.published, last,
                                  committed_landmarks(outcome.edit->landmarks, outcome.edit->base_landmarks, report));
  if (report.keyframes.size() == 2 && !keyframe.twist.isZero()) {
    state.track.twist = keyframe.twist;
    state.track.twist_interval_s = to_seconds(result.time_ns - state.waiting.back()->time_ns);
  }
  result.status = TrackStatus::kTracking;
  result.reason = LostReason::kNone;
  result.T_rig_world = keyframe.T_rig_world;
  result.anchored = state.track.anchored;
  outcome.record.root = report.published->root_of(last);
  if (report.keyframes.size() == 2) {
    const BundledFrame& first = *report.published->keyframe(report.keyframes[0]).frame;
    for (auto& early : state.waiting) {
      if (early->id >= first.id)
        outcome.early.push_back({std::move(early), report.keyframes[0], report.keyframes[1], first.time_ns,
                                 result.time_ns, report.published->shared_rig()});
    }
  }
  restart_monocular_start(state);
  state.frames_lost = 0;
  state.T_map_odom = result.T_rig_world.inverse() * state.T_rig_odom;
}

}  // namespace bslam::tracking
