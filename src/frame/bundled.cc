#include "frame/bundled.h"

#include <utility>

#include "base/assert.h"

namespace bslam::frame {
namespace {

using CameraBegins = std::span<const std::size_t>;

std::vector<std::size_t> camera_begins(std::span<const std::size_t> keypoint_counts) {
  std::vector<std::size_t> begin = {0};
  for (const std::size_t count : keypoint_counts) begin.push_back(begin.back() + count);
  return begin;
}

// Whether `f` has the keypoints refs[from, to), in order of distinct cameras, and these have the feature `f`.
bool is_feature(const Bundled::Arrays& arrays, CameraBegins cameras, std::size_t f) {
  std::int32_t last_camera = -1;
  for (std::size_t i = arrays.begin[f]; i < arrays.begin[f + 1]; ++i) {
    const KeypointRef r = arrays.refs[i];
    if (r.camera.value() <= last_camera || r.camera.index() + 1 >= cameras.size() || !r.keypoint.valid()) return false;
    const std::size_t keypoint = cameras[r.camera.index()] + r.keypoint.index();
    if (keypoint >= cameras[r.camera.index() + 1] || arrays.feature[keypoint] != FeatureId(f)) return false;
    last_camera = r.camera.value();
  }
  return true;
}

// Every keypoint has one entry in `refs` and one in `feature`; that each feature's keypoints name it makes both tables
// inverse to each other.
bool are_valid(const Bundled::Arrays& arrays, CameraBegins cameras, std::size_t num_matched) {
  const std::size_t keypoints = cameras.back();
  if (arrays.refs.size() != keypoints || arrays.feature.size() != keypoints || arrays.begin.empty()) return false;
  const std::size_t features = arrays.begin.size() - 1;
  if (num_matched > features || arrays.begin.front() != 0 || arrays.begin.back() != keypoints) return false;
  for (std::size_t f = 0; f < features; ++f) {
    const std::size_t from = arrays.begin[f], to = arrays.begin[f + 1];
    if (to > keypoints || (f < num_matched ? to < from + 2 : to != from + 1)) return false;
    if (!is_feature(arrays, cameras, f)) return false;
    if (f > num_matched && !(arrays.refs[from - 1] < arrays.refs[from])) return false;
  }
  return true;
}

}  // namespace

Bundled::Bundled(std::span<const std::size_t> keypoint_counts, std::span<const std::vector<KeypointRef>> matched,
                 std::span<const std::optional<BundledPoint>> points)
    : points_(std::vector(points.begin(), points.end())), num_matched_(matched.size()) {
  BSLAM_ASSERT(points.empty() || points.size() == matched.size(), "there must be one point entry per matched feature");
  std::vector<std::size_t> camera_begin = camera_begins(keypoint_counts);
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
  arrays_ = {std::move(refs), std::move(begin), std::move(feature)};
  camera_begin_ = std::move(camera_begin);
}

std::optional<Bundled> Bundled::from_arrays(std::span<const std::size_t> keypoint_counts, std::size_t num_matched,
                                            Arrays arrays, std::span<const std::optional<BundledPoint>> points) {
  std::vector<std::size_t> camera_begin = camera_begins(keypoint_counts);
  if (!are_valid(arrays, camera_begin, num_matched) || (!points.empty() && points.size() != num_matched)) return {};
  Bundled out;
  out.arrays_ = std::move(arrays);
  out.camera_begin_ = std::move(camera_begin);
  out.points_ = std::vector(points.begin(), points.end());
  out.num_matched_ = num_matched;
  return out;
}

Bundled Bundled::without_points() const {
  Bundled out = *this;
  out.points_ = {};
  return out;
}

std::size_t Bundled::memory_bytes(MemoryCount& count) const {
  return arrays_.refs.memory_bytes(count) + arrays_.begin.memory_bytes(count) + arrays_.feature.memory_bytes(count) +
         camera_begin_.memory_bytes(count) + points_.memory_bytes(count);
}

}  // namespace bslam::frame
