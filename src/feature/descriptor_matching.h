// Brute-force matching of descriptors.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "base/id.h"
#include "feature/hamming.h"
#include "feature/keypoints.h"

namespace bslam::feature {

// The nearest neighbour of a descriptor and the distance of the second nearest one, in bits.
struct NearestDescriptor {
  static constexpr int kNone = 257;  // larger than any distance
  std::size_t index = 0;             // the first one on ties
  int distance = kNone, second = kNone;

  // Returns true if the nearest descriptor is close and passes the ratio test.
  bool is_clear(int max_distance, double ratio) const { return distance <= max_distance && distance < ratio * second; }
};

// Searches the descriptors i for which allowed(i) is true.
template <class Allowed>
NearestDescriptor nearest_descriptor(const Descriptor& descriptor, std::span<const Descriptor> among,
                                     const Allowed& allowed) {
  NearestDescriptor out;
  for (std::size_t i = 0; i < among.size(); ++i) {
    if (!allowed(i)) continue;
    const int distance = hamming(descriptor, among[i]);
    if (distance < out.distance) {
      out.second = out.distance;
      out.distance = distance;
      out.index = i;
    } else if (distance < out.second) {
      out.second = distance;
    }
  }
  return out;
}

struct DescriptorMatch {
  KeypointIndex a, b;
};

// Mutual nearest neighbours that pass the ratio test, in order of `a`. `allowed(i, j)` returns true if descriptor i of
// `a` may match descriptor j of `b`.
template <class Allowed>
std::vector<DescriptorMatch> mutual_matches(std::span<const Descriptor> a, std::span<const Descriptor> b,
                                            int max_distance, double ratio, const Allowed& allowed) {
  std::vector<DescriptorMatch> matches;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const NearestDescriptor there = nearest_descriptor(a[i], b, [&](std::size_t j) { return allowed(i, j); });
    if (!there.is_clear(max_distance, ratio)) continue;
    const NearestDescriptor back =
        nearest_descriptor(b[there.index], a, [&](std::size_t k) { return allowed(k, there.index); });
    if (back.is_clear(max_distance, ratio) && back.index == i) {
      matches.push_back({KeypointIndex(i), KeypointIndex(there.index)});
    }
  }
  return matches;
}

// The same with bounds for matches whose positions are not predicted.
template <class Allowed>
std::vector<DescriptorMatch> mutual_matches(std::span<const Descriptor> a, std::span<const Descriptor> b,
                                            const Allowed& allowed) {
  constexpr int kMaxDistance = 60;  // bits
  constexpr double kRatio = 0.85;
  return mutual_matches(a, b, kMaxDistance, kRatio, allowed);
}

}  // namespace bslam::feature
