// k-majority clustering of binary descriptors. Internal to place.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/random.h"
#include "feature/keypoints.h"

namespace bslam::place {

struct Clusters {
  std::vector<feature::Descriptor> centre;  // every cluster has members
  std::vector<std::uint8_t>
      of;  // per descriptor: index of its cluster, which has the nearest centre (the first one on ties)
};

// Divides the descriptors into at most `k` (2 to 64) clusters; fewer if there are fewer distinct descriptors, one if
// all are equal. `descriptors` must not be empty. Centres are initialised by k-means++ (Arthur and Vassilvitskii, SODA
// 2007; the Hamming distance is the squared Euclidean distance of the bits). Each iteration sets each bit of a centre
// to the majority of its members and keeps the previous bit on ties. A centre without members moves to the descriptor
// that is farthest from its own centre.
Clusters cluster_by_majority(std::span<const feature::Descriptor> descriptors, int k, int iterations, Random& random);

// Returns the bitwise majority of the descriptors. On a tie the bit of `tie` is used.
feature::Descriptor majority(std::span<const feature::Descriptor> descriptors, const feature::Descriptor& tie);

}  // namespace bslam::place
