// Extraction of the keypoints of all cameras of a frame, in parallel.
#pragma once

#include <vector>

#include "base/thread_pool.h"
#include "feature/extractor.h"
#include "frame/bundled_frame.h"
#include "image/image_bundle.h"
#include "matching/bundling.h"

namespace bslam::matching {

// Owns the extractors and the pyramids of the last extracted frame, which are needed for sub-pixel alignment in
// tracking and replaced by the next extraction. Masks: one per camera; an empty image means no mask. Images may have
// masks of their own (image/image_bundle.h); a pixel is ignored if either mask is 0.
class FrameBuilder {
 public:
  FrameBuilder(std::size_t cameras, const feature::FeatureOptions& options, std::vector<image::Image> masks);

  // Extracts the keypoints of all images; the Bundled table of the result is empty. Cameras with skipped[i] != 0
  // (empty: no camera) are treated as if they had no image. budgets[i]: maximum number of keypoints of camera i (empty:
  // per_image of the options).
  frame::BundledFrame extract(const camera::Rig& rig, const image::ImageBundle& images, ThreadPool& pool,
                              std::span<const std::uint8_t> skipped = {}, std::span<const int> budgets = {});

  // Pyramids of the last extracted frame; empty for cameras without an image.
  std::span<const image::Pyramid> pyramids() const { return pyramids_; }

 private:
  image::ImageView mask_of(std::size_t camera, const image::CameraImage& image);

  std::vector<feature::Extractor> extractors_;
  std::vector<image::Image> masks_;
  std::vector<image::Image> combined_masks_;  // of images that have a mask and whose camera has one
  std::vector<image::Pyramid> pyramids_;
};

}  // namespace bslam::matching
