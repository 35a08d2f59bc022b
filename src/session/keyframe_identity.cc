#include "session/keyframe_identity.h"

#include <bit>

#include "place/content_hash.h"

namespace bslam::session {

std::uint64_t identity_of(const map::BundledKeyframe& keyframe) {
  place::ContentHash hash;
  for (const frame::CameraFrame& camera : keyframe.frame->cameras) {
    for (const feature::Descriptor& descriptor : camera.keypoints.descriptor) {
      for (const std::uint64_t word : descriptor) hash.add(word);
    }
    for (const Eigen::Vector2f& pixel : camera.keypoints.pixel) {
      hash.add(std::bit_cast<std::uint32_t>(pixel.x()));
      hash.add(std::bit_cast<std::uint32_t>(pixel.y()));
    }
  }
  return hash.value();
}

}  // namespace bslam::session
