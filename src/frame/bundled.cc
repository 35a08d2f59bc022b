#include "frame/bundled.h"

#include "base/assert.h"

namespace bslam::frame {

Bundled::Bundled(std::span<const std::size_t> keypoint_counts, std::span<const std::vector<KeypointRef>> matched,
                 std::span<const std::optional<BundledPoint>> points)
    : points_(points.begin(), points.end()), num_matched_(matched.size()) {
  BSLAM_ASSERT(points.size() == matched.size(), "one point slot per matched feature");
  camera_begin_.push_back(0);
  for (const std::size_t count : keypoint_counts) camera_begin_.push_back(camera_begin_.back() + count);
  feature_.assign(camera_begin_.back(), FeatureId());
  refs_.reserve(camera_begin_.back());
  begin_.push_back(0);
  const auto close_feature = [&] { begin_.push_back(static_cast<std::uint32_t>(refs_.size())); };
  const auto add = [&](KeypointRef ref) {
    FeatureId& slot = feature_[camera_begin_[ref.camera.index()] + ref.keypoint.index()];
    BSLAM_ASSERT(!slot.valid(), "a keypoint belongs to exactly one unique feature");
    slot = FeatureId(begin_.size() - 1);
    refs_.push_back(ref);
  };
  for (const std::vector<KeypointRef>& group : matched) {
    BSLAM_ASSERT(group.size() >= 2, "a matched feature has two or more keypoints");
    for (std::size_t i = 0; i < group.size(); ++i) {
      BSLAM_ASSERT(i == 0 || group[i - 1].camera < group[i].camera, "at most one keypoint per camera, in order of camera");
      add(group[i]);
    }
    close_feature();
  }
  for (std::size_t c = 0; c < keypoint_counts.size(); ++c) {
    for (std::size_t k = 0; k < keypoint_counts[c]; ++k) {
      if (feature_[camera_begin_[c] + k].valid()) continue;
      add({CameraIndex(c), KeypointIndex(k)});
      close_feature();
    }
  }
}

}  // namespace bslam::frame
