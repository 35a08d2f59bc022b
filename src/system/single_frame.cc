#include "system/single_frame.h"

#include <utility>

#include "matching/bundling.h"
#include "matching/frame_builder.h"
#include "tracking/calibration_error.h"
#include "tracking/feature_budget.h"

namespace bslam::system {

frame::BundledFrame single_frame(const camera::Rig& rig, const Config& config, std::vector<image::Image> masks,
                                 const image::ImageBundle& images) {
  ThreadPool pool(config.execution.threads_for(rig.size()));
  matching::FrameBuilder builder(rig.size(), config.features, std::move(masks));
  const std::vector<std::uint8_t> skipped(rig.size(), 0);
  const auto budgets = tracking::feature_budgets(rig.size(), {}, {}, skipped, config.features);
  const auto alignment = tracking::alignment_by_camera(config.tracking.alignment, {}, rig.size());
  frame::BundledFrame frame = builder.extract(rig, images, pool, skipped, budgets);
  if (!config.tracking.use_capture_times) {
    for (frame::CameraFrame& camera : frame.cameras) camera.time_ns = frame.time_ns;
  }
  return matching::bundle(frame::rig_of(rig, frame), frame, builder.pyramids(), config.bundling, alignment, pool);
}

}  // namespace bslam::system
