// Pyramids and keypoints of all cameras of a frame, computed in parallel.
#pragma once

#include <vector>

#include "base/thread_pool.h"
#include "feature/extractor.h"
#include "frame/bundled_frame.h"
#include "image/image_bundle.h"
#include "matching/bundling.h"

namespace bslam::matching {

// Pyramids and masks of a frame, which own their memory.
struct ReleasedImages {
  std::vector<image::Pyramid> pyramids;  // per camera, empty without an image
  std::vector<image::Image> masks;       // per camera, empty without a mask
};

// Owns the extractors and the pyramids of the last frame, which are needed for alignment in tracking and replaced by
// those of the next frame. Masks: one per camera; an empty image means no mask. Images may have
// masks of their own (image/image_bundle.h); a pixel is ignored if either mask is 0.
class FrameBuilder {
 public:
  FrameBuilder(std::size_t cameras, const feature::FeatureOptions& options, std::vector<image::Image> masks);

  // Builds the pyramids of all images. The result has no keypoints. Cameras with skipped[i] != 0 (empty: no camera) are
  // treated as if they had no image.
  frame::BundledFrame begin(const image::ImageBundle& images, ThreadPool& pool,
                            std::span<const std::uint8_t> skipped = {});

  // Extracts the keypoints of all images of the frame that was begun last. budgets[i]: maximum number of keypoints of
  // camera i (empty: per_image of the options). The Bundled table of the frame stays empty.
  void extract(const camera::Rig& rig, frame::BundledFrame& frame, ThreadPool& pool, std::span<const int> budgets = {});

  // Both steps.
  frame::BundledFrame extract(const camera::Rig& rig, const image::ImageBundle& images, ThreadPool& pool,
                              std::span<const std::uint8_t> skipped = {}, std::span<const int> budgets = {});

  // Pyramids and masks of the frame that was begun last; empty for cameras without an image, without a mask.
  std::span<const image::Pyramid> pyramids() const { return pyramids_; }
  std::span<const image::ImageView> masks() const { return current_masks_; }

  // The masks of the cameras, without those of single images.
  std::span<const image::Image> camera_masks() const { return masks_; }

  // Moves the images of the frame that was begun last to another builder, which can extract its keypoints later. After
  // release() this one has none until the next frame begins.
  ReleasedImages release();
  void adopt(ReleasedImages images);
  // Discards the images.
  void clear();
  // Frees the scratch memory of the extractors, which the next extraction allocates again.
  void free_scratch_memory();

  // Memory of the pyramids and masks that it holds, in bytes.
  std::size_t memory_bytes() const;

 private:
  image::ImageView mask_of(std::size_t camera, const image::CameraImage& image);

  feature::FeatureOptions options_;
  feature::PyramidShape shape_;
  std::vector<feature::Extractor> extractors_;
  std::vector<image::Image> masks_;
  // Combined masks of images with a mask whose camera has one as well, or adopted masks.
  std::vector<image::Image> combined_masks_;
  std::vector<image::Pyramid> pyramids_;
  std::vector<image::ImageView> current_masks_;
};

}  // namespace bslam::matching
