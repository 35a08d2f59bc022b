// Distance of binary descriptors.
#pragma once

#include <bit>

#include "feature/keypoints.h"

namespace bslam::feature {

// Number of differing bits, 0 to 256.
inline int hamming(const Descriptor& a, const Descriptor& b) {
  return std::popcount(a[0] ^ b[0]) + std::popcount(a[1] ^ b[1]) + std::popcount(a[2] ^ b[2]) +
         std::popcount(a[3] ^ b[3]);
}

}  // namespace bslam::feature
