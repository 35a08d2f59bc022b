// Clusters of binary descriptors around centres made by majority. Internal to place.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/random.h"
#include "feature/keypoints.h"

namespace bslam::place {

struct Clusters {
  std::vector<feature::Descriptor> centre;  // none without members
  std::vector<std::uint8_t> of;  // per descriptor: its cluster, the nearest centre, of equally near the first
};

// At most `k` (2 to 64) clusters; fewer where there are fewer different descriptors, one where all are equal.
// `descriptors` is not empty. Centres are seeded by k-means++ (Arthur and Vassilvitskii, SODA 2007; the Hamming
// distance is the squared Euclidean one of bits); then each bit of a centre is that of most members, and where there
// are as many with it as without it stays as it was. A centre that lost its members moves to the descriptor farthest
// from its own.
Clusters cluster_by_majority(std::span<const feature::Descriptor> descriptors, int k, int iterations, Random& random);

// The bits most of the descriptors have; `tie` where there are as many with as without.
feature::Descriptor majority(std::span<const feature::Descriptor> descriptors, const feature::Descriptor& tie);

}  // namespace bslam::place
