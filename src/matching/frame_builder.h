// Images of N cameras -> BundledFrame: extraction per camera in parallel, then bundling.
#pragma once

#include <vector>

#include "base/thread_pool.h"
#include "feature/extractor.h"
#include "frame/bundled_frame.h"
#include "image/image_bundle.h"
#include "matching/bundling.h"

namespace bslam::matching {

// Holds the extractors' scratch memory and the pyramids of the frame in hand, which sub-pixel alignment in tracking
// needs; the next extraction replaces them. Masks: one per camera, empty = none.
class FrameBuilder {
 public:
  FrameBuilder(const camera::Rig& rig, const feature::FeatureOptions& options, std::vector<image::Image> masks);

  // Keypoints of every present image; the Bundled table is still empty. Cameras with skipped[i] != 0 (or none where it
  // is empty) are taken as without an image; from camera i no more than budgets[i] keypoints are taken (empty:
  // per_image of the options).
  frame::BundledFrame extract(const image::ImageBundle& images, ThreadPool& pool,
                              std::span<const std::uint8_t> skipped = {}, std::span<const int> budgets = {});

  // Of the frame extracted last; empty for cameras without an image.
  std::span<const image::Pyramid> pyramids() const { return pyramids_; }

 private:
  const camera::Rig& rig_;
  std::vector<feature::Extractor> extractors_;
  std::vector<image::Image> masks_;
  std::vector<image::Pyramid> pyramids_;
};

}  // namespace bslam::matching
