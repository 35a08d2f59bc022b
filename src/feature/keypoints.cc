#include "feature/keypoints.h"

namespace bslam::feature {

void Keypoints::clear() {
  pixel.clear();
  level.clear();
  angle.clear();
  sigma.clear();
  bearing.clear();
  descriptor.clear();
  patch.clear();
}

void Keypoints::reserve(std::size_t n) {
  pixel.reserve(n);
  level.reserve(n);
  angle.reserve(n);
  sigma.reserve(n);
  bearing.reserve(n);
  descriptor.reserve(n);
  patch.reserve(n);
}

}  // namespace bslam::feature
