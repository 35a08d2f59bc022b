#include "system/keyframe_maker.h"

#include <utility>

#include "matching/bundling.h"

namespace bslam::system {

KeyframeMaker::KeyframeMaker(const camera::Rig& rig, const Config& config,
                             std::unique_ptr<tracking::Relocaliser> relocaliser, KeyframeObserver observer)
    : config_(config),
      observer_(std::move(observer)),
      pool_(config.execution.threads_for(rig.size())),
      builder_(rig.size(), config.features, {}),
      tracker_(rig, tracker_options(config), pool_, std::move(relocaliser)) {}

void KeyframeMaker::request(DeferredKeyframe deferred) {
  const FrameId frame = deferred.request.frame.id;
  const std::lock_guard lock(mutex_);
  requests_.emplace(frame, std::move(deferred));
}

DeferredKeyframe KeyframeMaker::take(FrameId frame) {
  const std::lock_guard lock(mutex_);
  auto found = requests_.extract(frame);
  BSLAM_ASSERT(!found.empty(), "a keyframe can only be created once of a frame that was requested");
  return std::move(found.mapped());
}

execution::StageResult KeyframeMaker::make(FrameId id, const map::MapSnapshot& base) {
  DeferredKeyframe deferred = take(id);
  frame::BundledFrame& frame = deferred.request.frame;
  const camera::Rig& rig = base->rig();
  if (frame::changes_frames(*deferred.rig, rig)) frame = frame::recalibrated(std::move(frame), *deferred.rig, rig);
  const map::AnchoredPose& pose = deferred.request.pose;
  if (pose.known_in(*base)) frame.twist = geometry::scaled(frame.twist, pose.scale_change(*base));
  builder_.adopt(std::move(deferred.images));
  builder_.extract(rig, frame, pool_, deferred.budgets);
  frame = matching::bundle(frame::rig_of(rig, frame), frame, builder_.pyramids(), config_.bundling, deferred.alignment,
                           pool_);
  const TimeNs time_ns = frame.time_ns;
  auto created = tracker_.create_keyframe(std::move(deferred.request), builder_.pyramids(), base);
  builder_.clear();
  if (!created) return {};
  {
    const std::lock_guard lock(mutex_);
    evidence_[id] = {std::move(created->next.budget_fractions), std::move(created->record.result.cameras)};
  }
  return {std::move(created->edit->draft), [this, id, time_ns](const map::CommitReport& report) {
            observer_({id, report.keyframes.front()}, time_ns);
          }};
}

FeatureEvidence KeyframeMaker::take_evidence(FrameId frame) {
  const std::lock_guard lock(mutex_);
  FeatureEvidence out = std::move(evidence_.at(frame));
  evidence_.erase(evidence_.begin(), evidence_.upper_bound(frame));
  return out;
}

}  // namespace bslam::system
