#include "system/frame_preparation.h"

#include <utility>

#include "matching/bundling.h"

namespace bslam::system {

using frame::BundledFrame;

FramePreparation::FramePreparation(const camera::Rig& rig, const Config& config, std::vector<image::Image> masks,
                                   ThreadPool& pool)
    : given_(rig),
      rig_(std::make_shared<const camera::Rig>(rig)),
      config_(config),
      pool_(pool),
      builder_(rig.size(), config.features, std::move(masks)) {}

BundledFrame FramePreparation::begin(const image::ImageBundle& images, const tracking::FramePlan& plan) {
  BundledFrame frame = builder_.begin(images, pool_, plan.skipped);
  frame.twist = plan.twist;
  frame.motion_unknown = plan.motion_unknown;
  for (std::size_t c = 0; c < frame.cameras.size(); ++c) {
    const TimeNs correction = rig_->camera(c).time_offset_ns - given_.camera(c).time_offset_ns;
    TimeNs& time_ns = frame.cameras[c].time_ns;
    time_ns = (config_.tracking.use_capture_times ? time_ns : frame.time_ns) + correction;
  }
  return frame;
}

void FramePreparation::extract(const tracking::FramePlan& plan, BundledFrame& frame) {
  builder_.extract(*rig_, frame, pool_, plan.budgets);
}

void FramePreparation::bundle(const tracking::FramePlan& plan, BundledFrame& frame) {
  frame = matching::bundle(frame::rig_of(*rig_, frame), frame, builder_.pyramids(), config_.bundling, plan.alignment,
                           pool_);
}

bool FramePreparation::adopt_rig(const map::BundledMap& map, BundledFrame& frame) {
  if (map.shared_rig() == rig_) return false;
  if (frame::changes_frames(*rig_, map.rig())) frame = frame::recalibrated(std::move(frame), *rig_, map.rig());
  rig_ = map.shared_rig();
  return true;
}

}  // namespace bslam::system
