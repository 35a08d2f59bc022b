#include "matching/frame_builder.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "base/assert.h"

namespace bslam::matching {

FrameBuilder::FrameBuilder(std::size_t cameras, const feature::FeatureOptions& options, std::vector<image::Image> masks)
    : options_(options),
      shape_(options.model().pyramid),
      masks_(std::move(masks)),
      combined_masks_(cameras),
      pyramids_(cameras),
      current_masks_(cameras) {
  masks_.resize(cameras);
  for (std::size_t i = 0; i < cameras; ++i) extractors_.emplace_back(options);
}

frame::BundledFrame FrameBuilder::begin(const image::ImageBundle& images, ThreadPool& pool,
                                        std::span<const std::uint8_t> skipped) {
  BSLAM_ASSERT(images.images.size() == pyramids_.size(), "there must be one image entry per camera of the rig");
  frame::BundledFrame frame;
  frame.id = images.id;
  frame.time_ns = images.time_ns;
  frame.cameras.resize(pyramids_.size());
  pool.for_each(pyramids_.size(), [&](std::size_t i) {
    const image::CameraImage& input = images.images[i];
    frame::CameraFrame& camera = frame.cameras[i];
    camera.state = !skipped.empty() && skipped[i] ? image::ImageState::kMissing : input.state;
    camera.time_ns = input.time_ns;
    current_masks_[i] = {};
    if (camera.state == image::ImageState::kPresent) {
      image::build_pyramid(input.view(), shape_.levels, shape_.scale_factor, pyramids_[i]);
      current_masks_[i] = mask_of(i, input);
    } else {
      pyramids_[i].levels.clear();
    }
  });
  return frame;
}

void FrameBuilder::extract(const camera::Rig& rig, frame::BundledFrame& frame, ThreadPool& pool,
                           std::span<const int> budgets) {
  BSLAM_ASSERT(rig.size() == pyramids_.size(), "the rig must have one camera per image");
  BSLAM_ASSERT(budgets.empty() || budgets.size() == rig.size(), "there must be one budget per camera of the rig");
  pool.for_each(rig.size(), [&](std::size_t i) {
    if (frame.cameras[i].state != image::ImageState::kPresent) return;
    const std::optional<int> budget = budgets.empty() ? std::nullopt : std::optional(budgets[i]);
    feature::Detections detections;
    extractors_[i].extract(pyramids_[i], current_masks_[i], rig.camera(i), detections, budget);
    frame.cameras[i].keypoints = std::move(detections);
  });
}

frame::BundledFrame FrameBuilder::extract(const camera::Rig& rig, const image::ImageBundle& images, ThreadPool& pool,
                                          std::span<const std::uint8_t> skipped, std::span<const int> budgets) {
  frame::BundledFrame frame = begin(images, pool, skipped);
  extract(rig, frame, pool, budgets);
  return frame;
}

ReleasedImages FrameBuilder::release() {
  ReleasedImages out;
  out.pyramids = std::exchange(pyramids_, std::vector<image::Pyramid>(pyramids_.size()));
  for (image::ImageView& mask : current_masks_) out.masks.push_back(image::copy_of(std::exchange(mask, {})));
  return out;
}

void FrameBuilder::adopt(ReleasedImages images) {
  BSLAM_ASSERT(images.pyramids.size() == pyramids_.size() && images.masks.size() == pyramids_.size(),
               "there must be one image per camera of the rig");
  pyramids_ = std::move(images.pyramids);
  combined_masks_ = std::move(images.masks);
  for (std::size_t i = 0; i < combined_masks_.size(); ++i) current_masks_[i] = combined_masks_[i].view();
}

void FrameBuilder::clear() {
  pyramids_.assign(pyramids_.size(), {});
  std::ranges::fill(current_masks_, image::ImageView());
}

void FrameBuilder::free_scratch_memory() {
  for (feature::Extractor& extractor : extractors_) extractor = feature::Extractor(options_);
}

image::ImageView FrameBuilder::mask_of(std::size_t camera, const image::CameraImage& image) {
  const image::ImageView of_camera = masks_[camera].view(), of_image = image.mask_view();
  if (of_image.empty()) return of_camera;
  BSLAM_ASSERT(of_image.width == image.view().width && of_image.height == image.view().height,
               "a mask must have the size of its image");
  if (of_camera.empty()) return of_image;
  image::Image& combined = combined_masks_[camera];
  combined.resize(of_image.width, of_image.height);
  for (int y = 0; y < of_image.height; ++y) {
    std::transform(of_image.row(y), of_image.row(y) + of_image.width, of_camera.row(y), combined.row(y),
                   [](std::uint8_t a, std::uint8_t b) { return std::min(a, b); });
  }
  return combined.view();
}

std::size_t FrameBuilder::memory_bytes() const {
  std::size_t bytes = 0;
  for (const image::Pyramid& pyramid : pyramids_) {
    for (const image::Image& level : pyramid.levels) bytes += level.memory_bytes();
  }
  for (const image::Image& mask : masks_) bytes += mask.memory_bytes();
  for (const image::Image& mask : combined_masks_) bytes += mask.memory_bytes();
  return bytes;
}

}  // namespace bslam::matching
