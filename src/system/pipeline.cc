#include "system/pipeline.h"

#include <algorithm>

#include "base/assert.h"
#include "base/stopwatch.h"
#include "tracking/camera_evidence.h"

namespace bslam::system {
namespace {

using frame::BundledFrame;

execution::JournalStep journal_step(tracking::ProposedEdit::Kind kind) {
  return kind == tracking::ProposedEdit::Kind::kKeyframe ? execution::JournalStep::kTrack
                                                         : execution::JournalStep::kStart;
}

}  // namespace

Pipeline::Pipeline(const camera::Rig& rig, CamerasOfRun cameras, const Config& config, std::vector<image::Image> masks,
                   std::unique_ptr<tracking::Relocaliser> relocaliser, KeyframeMaker* keyframe_maker)
    : config_(config),
      pool_(config.execution.threads_for(cameras.size)),
      monitor_(rig.size(), config.health),
      status_(rig.size()),
      overlapping_(tracking::overlapping_cameras(rig)),
      preparation_(rig, config, std::move(masks), pool_),
      tracker_(rig, tracker_options(config, cameras), pool_, std::move(relocaliser)),
      keyframe_maker_(keyframe_maker) {}

Pipeline::Outcome Pipeline::process(const image::ImageBundle& images, execution::StageExecutor& executor) {
  const Stopwatch whole;
  Outcome outcome;
  tracking::ImageFaults faults = monitor_.examine(images, preparation_.camera_masks(), pool_);
  const tracking::FramePlan plan = tracker_.plan(images, faults, state_);

  std::vector<StageTime> stages;
  tracking::TrackOutcome tracked = track(images, plan, faults, executor, outcome, stages);
  if (tracked.edit && tracked.edit->kind == tracking::ProposedEdit::Kind::kRig)
    tracked = track_with_corrected_rig(images, plan, std::move(tracked), executor, outcome);
  tracked.record.scale = outcome.seen->scale();
  if (tracked.edit) commit(tracked, executor, outcome);
  state_ = std::move(tracked.next);
  outcome.early = std::move(tracked.early);
  outcome.observed = std::move(tracked.observed);

  outcome.record = std::move(tracked.record);
  FrameRecord& record = outcome.record;
  record.stages.insert(record.stages.begin(), stages.begin(), stages.end());
  record.reduction = state_.reduction;
  auto evidence = tracking::camera_evidence(images, faults, plan.postponed, record, outcome.created_cameras);
  tracking::leave_out_inliers_of_new_map(outcome.seen->num_keyframes(), overlapping_, evidence);
  record.cameras = status_.update(evidence);
  for (const image::CameraImage& i : images.images) record.images.push_back(i.state);
  record.frame_ms = whole.ms();
  return outcome;
}

void Pipeline::set_reduction(int level) {
  tracking::change_level(state_.reduction, level, state_.track);
  state_.reduction = level;
}

// Tracks the frame without features if possible. Its features are extracted otherwise, before the map is needed if this
// is known from the start.
tracking::TrackOutcome Pipeline::track(const image::ImageBundle& images, const tracking::FramePlan& plan,
                                       tracking::ImageFaults& faults, execution::StageExecutor& executor,
                                       Outcome& outcome, std::vector<StageTime>& stages) {
  Stopwatch watch;
  const auto end_stage = [&](std::string_view stage) {
    stages.push_back({stage, watch.ms()});
    watch = Stopwatch();
  };
  BundledFrame frame = preparation_.begin(images, plan);
  end_stage("pyramids");
  const auto add_features = [&] {
    preparation_.extract(plan, frame);
    end_stage("extract");
    preparation_.bundle(plan, frame);
    end_stage("bundle");
  };
  bool directly = tracker_.tracks_directly(state_);
  if (!directly) add_features();
  outcome.seen = executor.begin_frame(frame.id, frame.time_ns);
  // It was planned at the scale of the state.
  frame.twist = geometry::scaled(frame.twist, state_.track.anchored.scale_change(*outcome.seen));
  const bool recalibrated = preparation_.adopt_rig(*outcome.seen, frame);
  if (recalibrated) tracker_.restart_monocular_start(state_);
  const auto created = adopt_keyframe(outcome);
  if (drop_repeated(*outcome.seen, faults, frame)) directly = false;
  if (config_.mode != execution::Mode::kSequential) end_stage("results");

  tracking::DirectAttempt direct;
  if (directly) {
    direct = tracker_.process_directly(state_, frame, preparation_.images(), outcome.seen);
    if (direct.failure != tracking::DirectFailure::kNone) {
      end_stage("align");
      add_features();
    }
  }
  tracking::TrackOutcome found =
      direct.failure == tracking::DirectFailure::kNone
          ? *std::move(direct.outcome)
          : tracker_.process(std::move(state_), std::move(frame), preparation_.images().pyramids, outcome.seen,
                             std::move(direct));
  found.record.recalibrated = recalibrated;
  found.record.created = created;
  if (found.keyframe_wanted) outcome.deferred = defer_keyframe(plan, std::move(frame), found);
  return found;
}

// Removes the images of a frame that repeat those of the frame before although the rig moves.
bool Pipeline::drop_repeated(const map::BundledMap& map, tracking::ImageFaults& faults, BundledFrame& frame) {
  tracker_.note_repetition(faults.repeated, frame.time_ns, map, state_);
  if (!state_.stalled) return false;
  std::ranges::replace(faults.outage, tracking::CameraReason::kNone, tracking::CameraReason::kFrozen);
  frame = frame::without_images(frame);
  return true;
}

// Commits the correction of the rig that a frame gave before a map was started, and bundles and processes the features
// of the frame again. The tracker does not propose another one for the same frame.
tracking::TrackOutcome Pipeline::track_with_corrected_rig(const image::ImageBundle& images,
                                                          const tracking::FramePlan& plan,
                                                          tracking::TrackOutcome&& tracked,
                                                          execution::StageExecutor& executor, Outcome& outcome) {
  const Stopwatch watch;
  outcome.seen = executor.commit(execution::JournalStep::kStart, std::move(tracked.edit->draft)).published;
  preparation_.set_rig(outcome.seen->shared_rig());
  BundledFrame frame = preparation_.begin(images, plan);
  preparation_.extract(plan, frame);
  preparation_.bundle(plan, frame);
  const double corrected_ms = tracked.record.stages.back().ms + watch.ms();
  tracking::TrackOutcome again =
      tracker_.process(std::move(tracked.next), std::move(frame), preparation_.images().pyramids, outcome.seen);
  again.record.recalibrated = true;
  again.record.stages.insert(again.record.stages.begin(), {"correct rig", corrected_ms});
  return again;
}

// Passes a frame that was tracked directly and its images to the keyframe maker, which creates a keyframe from it.
FrameId Pipeline::defer_keyframe(const tracking::FramePlan& plan, BundledFrame frame,
                                 const tracking::TrackOutcome& found) {
  BSLAM_ASSERT(keyframe_maker_ != nullptr, "no keyframes are created while localising");
  const FrameId id = frame.id;
  tracking::KeyframeRequest request{std::move(frame), std::move(state_), found.record.result.anchored};
  keyframe_maker_->request(
      {std::move(request), preparation_.release(), plan.budgets, plan.alignment, preparation_.rig()});
  return id;
}

std::optional<tracking::CreatedKeyframe> Pipeline::adopt_keyframe(Outcome& outcome) {
  const auto created = tracker_.adopt_keyframe(*outcome.seen, state_);
  if (!created) return std::nullopt;
  FeatureEvidence evidence = keyframe_maker_->take_evidence(created->frame);
  state_.budget_fractions = std::move(evidence.budget_fractions);
  outcome.created_cameras = std::move(evidence.cameras);
  return created;
}

void Pipeline::commit(tracking::TrackOutcome& tracked, execution::StageExecutor& executor, Outcome& outcome) {
  const Stopwatch watch;
  tracking::ProposedEdit& edit = *tracked.edit;
  const map::CommitReport report = executor.commit(journal_step(edit.kind), std::move(edit.draft));
  tracker_.committed(report, tracked);
  for (const KeyframeId k : report.keyframes)
    outcome.keyframes.push_back({k, report.published->keyframe(k).frame->time_ns});
  outcome.started_submap = edit.kind == tracking::ProposedEdit::Kind::kStart;
  if (outcome.started_submap) tracked.record.scale = report.published->scale();
  tracked.record.stages.back().ms += watch.ms();  // added to the time of the stage that proposed the edit
}

}  // namespace bslam::system
