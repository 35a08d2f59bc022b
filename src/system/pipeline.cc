#include "system/pipeline.h"

#include <algorithm>
#include <thread>

#include "system/stopwatch.h"
#include "tracking/make_keyframe.h"

namespace bslam::system {
namespace {

using frame::BundledFrame;

constexpr int kMaxStartAge = 40;  // frames after which a start up to scale compares with a fresh frame

int thread_count(int wanted, std::size_t cameras) {
  const int available = wanted > 0 ? wanted : std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  return std::min(available, static_cast<int>(cameras));
}

// Landmarks of a keyframe by the ids given at commit.
std::vector<LandmarkId> committed(const std::vector<LandmarkId>& provisional, std::size_t base_slots,
                                  const map::CommitReport& report) {
  std::vector<LandmarkId> out;
  for (const LandmarkId l : provisional) {
    const LandmarkId id = l.index() < base_slots ? report.published->resolve(l) : report.landmarks[l.index() - base_slots];
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

std::vector<tracking::CameraCounts> keypoint_counts(const BundledFrame& frame) {
  std::vector<tracking::CameraCounts> counts;
  for (const frame::CameraFrame& c : frame.cameras) counts.push_back({static_cast<int>(c.keypoints.size()), 0, 0});
  return counts;
}

}  // namespace

Pipeline::Pipeline(const camera::Rig& rig, const Config& config, std::vector<image::Image> masks)
    : rig_(rig), config_(config), pool_(thread_count(config.execution.threads, rig.size())),
      builder_(rig, config.features, std::move(masks)) {}

void Pipeline::restart() {
  state_ = {};
  candidate_.reset();
}

BundledFrame Pipeline::make_frame(const image::ImageBundle& images, std::vector<StageTime>& stages) {
  const Stopwatch extraction;
  BundledFrame frame = builder_.extract(images, pool_);
  stages.push_back({"extract", extraction.ms()});
  const Stopwatch bundling;
  frame.bundled =
      frame::bundle(rig_, frame.cameras, builder_.pyramids(), config_.bundling, config_.tracking.alignment, pool_);
  for (std::size_t c = 0; c < rig_.size(); ++c) {
    frame.cameras[c].grid = frame::FeatureGrid(frame.cameras[c].keypoints, rig_.camera(c).width, rig_.camera(c).height);
  }
  stages.push_back({"bundle", bundling.ms()});
  return frame;
}

Pipeline::Outcome Pipeline::process(const image::ImageBundle& images, map::MapStore& store) {
  const Stopwatch whole;
  Outcome outcome;
  for (const image::CameraImage& i : images.images) outcome.record.images.push_back(i.state);
  BundledFrame frame = make_frame(images, outcome.record.stages);
  count_features(frame, outcome.record);
  if (state_.status == tracking::TrackStatus::kNotStarted) {
    start(std::move(frame), store, outcome);
  } else {
    track(std::move(frame), store, outcome);
  }
  outcome.record.frame_ms = whole.ms();
  return outcome;
}

void Pipeline::start(BundledFrame frame, map::MapStore& store, Outcome& outcome) {
  const Stopwatch watch;
  tracking::TrackResult& result = outcome.record.result;
  result.frame = frame.id;
  result.time_ns = frame.time_ns;
  result.status = tracking::TrackStatus::kLost;
  result.reason = tracking::LostReason::kNotStarted;
  result.cameras = keypoint_counts(frame);
  const map::MapSnapshot base = store.snapshot();
  map::MapDraft draft("start", base);
  const auto& options = config_.tracking.initialisation;
  std::optional<tracking::StartedMap> started;
  if (rig_.any_overlap()) {
    started = tracking::start_metric(frame, builder_.pyramids(), options, draft);
  } else if (candidate_) {
    const Random random(static_cast<std::uint64_t>(config_.seed), "start", static_cast<std::uint64_t>(frame.id.value()));
    started = tracking::start_up_to_scale(*candidate_, frame, builder_.pyramids(), options, random, draft);
  }
  if (started) {
    draft.set_scale(started->scale);
    const map::CommitReport report = store.commit(std::move(draft));
    const KeyframeId last = report.keyframes.back();
    state_ = tracking::state_at_keyframe({}, frame.time_ns, last,
                                         committed(started->keyframes.back().landmarks, base->landmark_slots(), report));
    result.status = tracking::TrackStatus::kTracking;
    result.reason = tracking::LostReason::kNone;
    result.T_rig_world = report.published->keyframe(last).T_rig_world;
    result.reference = last;
    outcome.keyframes = report.keyframes;
    outcome.record.keyframe = true;
    candidate_.reset();
  } else if (!rig_.any_overlap()) {
    keep_candidate(std::move(frame));
  }
  outcome.record.stages.push_back({"start", watch.ms()});
}

// The frame later ones are compared with is given up when it is old or its view is gone.
void Pipeline::keep_candidate(BundledFrame frame) {
  const auto& options = config_.tracking.initialisation;
  if (candidate_ && frame.num_keypoints() < static_cast<std::size_t>(options.min_monocular)) return;  // nothing to go by
  const bool good = candidate_ && frame.id.value() - candidate_->frame->id.value() <= kMaxStartAge &&
                    tracking::comparable(*candidate_->frame, frame, options);
  if (good) return;
  const auto pyramids = builder_.pyramids();
  candidate_ = tracking::StartCandidate{std::make_shared<const BundledFrame>(std::move(frame)), {pyramids.begin(), pyramids.end()}};
}

void Pipeline::track(BundledFrame frame, map::MapStore& store, Outcome& outcome) {
  const Stopwatch watch;
  const map::MapSnapshot snapshot = store.snapshot();
  const tracking::TrackInput input{.map = *snapshot,
                                   .pyramids = builder_.pyramids(),
                                   .state = state_,
                                   .noise = {config_.features.sigma_px},
                                   .scale_factor = config_.features.scale_factor,
                                   .seed = static_cast<std::uint64_t>(config_.seed)};
  tracking::TrackOutput output = tracking::track(input, frame, config_.tracking, pool_);
  state_ = std::move(output.state);
  outcome.record.result = output.result;
  outcome.record.stages.push_back({"track", watch.ms()});
  if (!output.keyframe_due) return;
  const Stopwatch keyframe_watch;
  add_keyframe(frame, output, snapshot, store, outcome);
  outcome.record.stages.push_back({"keyframe", keyframe_watch.ms()});
}

void Pipeline::add_keyframe(const BundledFrame& frame, const tracking::TrackOutput& output, map::MapSnapshot base,
                            map::MapStore& store, Outcome& outcome) {
  map::MapDraft draft("track", base);
  draft.add_sightings(folded(std::move(state_.sightings)));
  const tracking::NewKeyframe made =
      tracking::make_keyframe(frame, output.matches, output.result.T_rig_world, builder_.pyramids(), output.result.reference,
                              config_.tracking.initialisation, draft);
  const map::CommitReport report = store.commit(std::move(draft));
  state_ = tracking::state_at_keyframe(state_, frame.time_ns, report.keyframes.front(),
                                       committed(made.landmarks, base->landmark_slots(), report));
  outcome.record.result.reference = report.keyframes.front();
  outcome.record.result.T_rig_reference = geometry::SE3();
  outcome.record.keyframe = true;
  outcome.keyframes = report.keyframes;
}

}  // namespace bslam::system
