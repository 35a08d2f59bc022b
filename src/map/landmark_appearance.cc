// Appearance of a landmark: viewing direction, distance range, descriptor.
#include <algorithm>
#include <cmath>

#include "feature/hamming.h"
#include "map/bundled_map.h"

namespace bslam::map {
namespace {

// Maximum number of descriptors for the medoid, of the newest observations; the cost is quadratic.
constexpr std::size_t kMaxDescriptors = 24;

// The descriptor with the smallest median distance to the others; on ties the first. `descriptors` must not be empty.
feature::Descriptor medoid(std::span<const feature::Descriptor> descriptors) {
  const std::size_t n = descriptors.size();
  std::array<std::array<int, kMaxDescriptors>, kMaxDescriptors> distance;
  for (std::size_t i = 0; i < n; ++i) {
    distance[i][i] = 0;
    for (std::size_t j = 0; j < i; ++j)
      distance[i][j] = distance[j][i] = feature::hamming(descriptors[i], descriptors[j]);
  }
  std::size_t best = 0;
  int best_median = 257;
  for (std::size_t i = 0; i < n; ++i) {
    // The distance 0 to itself is the smallest, so that the lower median of the others is at n / 2. The median is only
    // computed if it is smaller than the best one, which is determined by counting.
    const std::span row = std::span(distance[i]).first(n);
    if (static_cast<std::size_t>(std::ranges::count_if(row, [&](int d) { return d < best_median; })) <= n / 2) continue;
    const auto middle = row.begin() + static_cast<std::ptrdiff_t>(n / 2);
    std::nth_element(row.begin(), middle, row.end());
    best_median = *middle;
    best = i;
  }
  return descriptors[best];
}

// A step of the hash of a sequence of observations (the finaliser of SplitMix64).
std::uint64_t mixed(std::uint64_t hash, const Observation& o) {
  hash ^= static_cast<std::uint64_t>(o.keyframe.value()) << 32 | static_cast<std::uint32_t>(o.feature.value());
  hash = (hash ^ (hash >> 30)) * 0xbf58476d1ce4e5b9u;
  hash = (hash ^ (hash >> 27)) * 0x94d049bb133111ebu;
  return hash ^ (hash >> 31);
}

}  // namespace

void BundledMap::refresh_descriptor(LandmarkId l) {
  Landmark& entry = edit(l);
  std::uint64_t source = 1;
  for (const Observation& o : observations(l)) source = mixed(source, o);
  if (source == entry.descriptor_source) return;
  entry.descriptor_source = source;
  std::array<feature::Descriptor, kMaxDescriptors> ring;
  std::size_t count = 0;
  for (const Observation& o : observations(l)) {
    const frame::BundledFrame& frame = *keyframe(o.keyframe).frame;
    for (const frame::KeypointRef r : frame.bundled.keypoints(o.feature))
      ring[count++ % kMaxDescriptors] = frame.keypoints(r.camera).descriptor[r.keypoint.index()];
  }
  if (count > kMaxDescriptors) {  // oldest first, for ties
    std::rotate(ring.begin(), ring.begin() + static_cast<std::ptrdiff_t>(count % kMaxDescriptors), ring.end());
  }
  entry.descriptor = medoid(std::span(ring).first(std::min(count, kMaxDescriptors)));
}

bool BundledMap::refresh_landmark(LandmarkId l) {
  if (!alive(l)) return false;
  refresh_descriptor(l);
  Landmark& entry = edit(l);
  const auto centre_map = [&](const BundledKeyframe& k, CameraIndex camera) -> Eigen::Vector3d {
    const Eigen::Vector3d centre_rig = rig_from_cam(k, camera).translation();
    return k.T_rig_world.rotation().conjugate() * (centre_rig - k.T_rig_world.translation());
  };

  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Observation& o : observations(l)) {
    const BundledKeyframe& k = keyframe(o.keyframe);
    for (const frame::KeypointRef& r : k.frame->bundled.keypoints(o.feature))
      sum += (entry.position - centre_map(k, r.camera)).normalized();
  }
  entry.view_direction = sum.normalized();

  // A patch detected on level n at distance d appears on level 0 at distance d * scale^n, and on the highest level at
  // that distance divided by the scale of the highest level.
  const BundledKeyframe& k = keyframe(entry.reference.keyframe);
  const frame::KeypointRef r = entry.reference.keypoint;
  const int level = k.frame->keypoints(r.camera).level[r.keypoint.index()];
  const double distance = (entry.position - centre_map(k, r.camera)).norm();
  const double max_distance = distance * pyramid_.scale(level);
  entry.max_distance = static_cast<float>(max_distance);
  entry.min_distance = static_cast<float>(max_distance / pyramid_.scale(pyramid_.levels - 1));
  return true;
}

}  // namespace bslam::map
