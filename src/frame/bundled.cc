#include "frame/bundled.h"

#include <utility>

#include "base/assert.h"

namespace bslam::frame {

Bundled::Bundled(std::span<const std::size_t> keypoint_counts, std::span<const std::vector<KeypointRef>> matched,
                 std::span<const std::optional<BundledPoint>> points)
    : points_(std::vector(points.begin(), points.end())), num_matched_(matched.size()) {
  BSLAM_ASSERT(points.size() == matched.size(), "there must be one point entry per matched feature");
  std::vector<std::size_t> camera_begin = {0};
  for (const std::size_t count : keypoint_counts) camera_begin.push_back(camera_begin.back() + count);
  std::vector<FeatureId> feature(camera_begin.back());
  std::vector<KeypointRef> refs;
  refs.reserve(camera_begin.back());
  std::vector<std::uint32_t> begin = {0};
  begin.reserve(camera_begin.back() + 1);
  const auto close_feature = [&] { begin.push_back(static_cast<std::uint32_t>(refs.size())); };
  const auto add = [&](KeypointRef ref) {
    FeatureId& slot = feature[camera_begin[ref.camera.index()] + ref.keypoint.index()];
    BSLAM_ASSERT(!slot.valid(), "a keypoint must not belong to two features");
    slot = FeatureId(begin.size() - 1);
    refs.push_back(ref);
  };
  for (const std::vector<KeypointRef>& group : matched) {
    BSLAM_ASSERT(group.size() >= 2, "a matched feature must have two or more keypoints");
    for (std::size_t i = 0; i < group.size(); ++i) {
      BSLAM_ASSERT(i == 0 || group[i - 1].camera < group[i].camera,
                   "the keypoints of a feature must be in order of distinct cameras");
      add(group[i]);
    }
    close_feature();
  }
  for (std::size_t c = 0; c < keypoint_counts.size(); ++c) {
    for (std::size_t k = 0; k < keypoint_counts[c]; ++k) {
      if (feature[camera_begin[c] + k].valid()) continue;
      add({CameraIndex(c), KeypointIndex(k)});
      close_feature();
    }
  }
  refs_ = std::move(refs);
  begin_ = std::move(begin);
  feature_ = std::move(feature);
  camera_begin_ = std::move(camera_begin);
}

std::size_t Bundled::memory_bytes(MemoryCount& count) const {
  return refs_.memory_bytes(count) + begin_.memory_bytes(count) + feature_.memory_bytes(count) +
         camera_begin_.memory_bytes(count) + points_.memory_bytes(count);
}

}  // namespace bslam::frame
