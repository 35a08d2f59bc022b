#include "matching/frame_builder.h"

#include <optional>
#include <utility>

#include "base/assert.h"

namespace bslam::matching {

FrameBuilder::FrameBuilder(std::size_t cameras, const feature::FeatureOptions& options, std::vector<image::Image> masks)
    : masks_(std::move(masks)), pyramids_(cameras) {
  masks_.resize(cameras);
  for (std::size_t i = 0; i < cameras; ++i) extractors_.emplace_back(options);
}

frame::BundledFrame FrameBuilder::extract(const camera::Rig& rig, const image::ImageBundle& images, ThreadPool& pool,
                                          std::span<const std::uint8_t> skipped, std::span<const int> budgets) {
  BSLAM_ASSERT(rig.size() == pyramids_.size() && images.images.size() == rig.size(),
               "there must be one image entry per camera of the rig");
  BSLAM_ASSERT(budgets.empty() || budgets.size() == rig.size(), "there must be one budget per camera of the rig");
  frame::BundledFrame frame;
  frame.id = images.id;
  frame.time_ns = images.time_ns;
  frame.cameras.resize(rig.size());
  pool.for_each(rig.size(), [&](std::size_t i) {
    const image::CameraImage& input = images.images[i];
    frame::CameraFrame& camera = frame.cameras[i];
    camera.state = !skipped.empty() && skipped[i] ? image::ImageState::kMissing : input.state;
    camera.time_ns = input.time_ns;
    if (camera.state == image::ImageState::kPresent) {
      const std::optional<int> budget = budgets.empty() ? std::nullopt : std::optional(budgets[i]);
      feature::Detections detections;
      extractors_[i].extract(input.view(), masks_[i].view(), rig.camera(i), pyramids_[i], detections, budget);
      camera.keypoints = std::move(detections);
    } else {
      pyramids_[i].levels.clear();
    }
  });
  return frame;
}

}  // namespace bslam::matching
