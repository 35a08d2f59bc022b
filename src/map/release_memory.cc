// Releases memory that a map no longer needs.
#include <algorithm>

#include "base/mapped_file.h"
#include "map/bundled_map.h"

namespace bslam::map {

void BundledMap::free_removed(std::size_t slots) {
  const std::size_t groups = landmarks_.size() / kLandmarksPerChunk;  // blocks that are full
  for (std::size_t n = std::min(slots / kLandmarksPerChunk, groups); n > 0; --n) {
    if (next_chunk_to_free_ >= groups) next_chunk_to_free_ = 0;
    const std::size_t group = next_chunk_to_free_++;
    bool gone = true;
    for (std::size_t l = group * kLandmarksPerChunk; gone && l < (group + 1) * kLandmarksPerChunk; ++l)
      gone = !landmarks_[l].alive;
    if (!gone) continue;
    landmarks_.blank_chunk(group, owner_.tag());
    observations_.blank_block(group, owner_.tag());
  }
}

void BundledMap::release_pages() const {
  if (file_) file_->release();
}

void BundledMap::release_unused(std::size_t count) {
  for (; count > 0 && next_keyframe_to_release_ + kNewKeyframes < keyframes_.size(); --count) {
    const KeyframeId k(next_keyframe_to_release_++);
    if (alive(k)) release_unused(k);
  }
}

void BundledMap::release_unused(KeyframeId k) {
  const BundledKeyframe& entry = keyframe(k);
  std::vector<std::vector<std::uint8_t>> wanted;
  for (const frame::CameraFrame& c : entry.frame->cameras) wanted.emplace_back(c.keypoints.size(), std::uint8_t{0});
  const auto want = [&](frame::KeypointRef r) { wanted[r.camera.index()][r.keypoint.index()] = 1; };
  for (std::size_t f = 0; f < entry.landmarks.size(); ++f) {
    const LandmarkId l = entry.landmarks[f];
    if (!l.valid()) continue;
    want(entry.frame->bundled.keypoints(FeatureId(f)).front());
    if (landmark(l).reference.keyframe == k) want(landmark(l).reference.keypoint);
  }
  frame::BundledFrame out = *entry.frame;
  for (std::size_t c = 0; c < out.cameras.size(); ++c) {
    out.cameras[c].keypoints.patch = out.cameras[c].keypoints.patch.only(wanted[c]);
    out.cameras[c].grid = out.cameras[c].grid.emptied();
  }
  out.bundled = out.bundled.without_points();
  edit(k).frame = std::make_shared<const frame::BundledFrame>(std::move(out));
}

// The oldest observation whose first keypoint has a patch, or the oldest if there is none.
LandmarkReference BundledMap::reference_among(std::span<const Observation> observations) const {
  const auto first = [&](const Observation& o) {
    return LandmarkReference{o.keyframe, keyframe(o.keyframe).frame->bundled.keypoints(o.feature).front()};
  };
  for (const Observation& o : observations) {
    const LandmarkReference reference = first(o);
    const frame::KeypointRef r = reference.keypoint;
    if (keypoints(o.keyframe, r.camera).patch.find(r.keypoint.index()) != nullptr) return reference;
  }
  return first(observations.front());
}

}  // namespace bslam::map
