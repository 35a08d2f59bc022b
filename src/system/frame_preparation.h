// Frames with pyramids, capture times and bundled keypoints, computed from images with the rig of the map.
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "base/thread_pool.h"
#include "map/bundled_map.h"
#include "matching/frame_builder.h"
#include "system/config.h"
#include "tracking/tracker.h"

namespace bslam::system {

class FramePreparation {
 public:
  // `rig`: the rig as given; its time offsets are included in the capture times of the images. `config` and `pool` must
  // outlive the object. Masks: see matching::FrameBuilder.
  FramePreparation(const camera::Rig& rig, const Config& config, std::vector<image::Image> masks, ThreadPool& pool);

  // Begins a frame: its pyramids, capture times and predicted velocity. It has no keypoints.
  frame::BundledFrame begin(const image::ImageBundle& images, const tracking::FramePlan& plan);
  // Extracts the keypoints of the frame that was begun last.
  void extract(const tracking::FramePlan& plan, frame::BundledFrame& frame);
  // Bundles them.
  void bundle(const tracking::FramePlan& plan, frame::BundledFrame& frame);

  // The rig with which frames are prepared.
  const std::shared_ptr<const camera::Rig>& rig() const { return rig_; }
  void set_rig(std::shared_ptr<const camera::Rig> rig) { rig_ = std::move(rig); }
  // Continues with the rig of the map and adapts `frame`, which was prepared with the present one. Returns true if a
  // stage has replaced the rig since the last frame.
  bool adopt_rig(const map::BundledMap& map, frame::BundledFrame& frame);

  // The images of the frame that was begun last. release() moves them out.
  tracking::FrameImages images() const { return {builder_.pyramids(), builder_.masks()}; }
  matching::ReleasedImages release() { return builder_.release(); }
  std::span<const image::Image> camera_masks() const { return builder_.camera_masks(); }
  // See matching::FrameBuilder.
  void free_scratch_memory() { builder_.free_scratch_memory(); }
  std::size_t memory_bytes() const { return builder_.memory_bytes(); }

 private:
  const camera::Rig given_;
  std::shared_ptr<const camera::Rig> rig_;  // rig of the map in which the last frame was tracked
  const Config& config_;
  ThreadPool& pool_;
  matching::FrameBuilder builder_;
};

}  // namespace bslam::system
