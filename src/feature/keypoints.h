// The keypoints of one camera: struct of arrays, all of equal length.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace bslam::feature {

using Descriptor = std::array<std::uint64_t, 4>;  // 256 binary tests

// Small window of the level a keypoint was found on, centred on the keypoint (sampled at its sub-pixel position),
// upright: what sub-pixel alignment needs once the image is gone. Row-major, kPatchSize x kPatchSize grey values at
// offsets -kPatchSize/2 + 0.5 ... in pixels of the level, so that the keypoint lies between the four middle samples.
constexpr int kPatchSize = 10;  // 8 x 8 plus a border of one for gradients
using Patch = std::array<std::uint8_t, kPatchSize * kPatchSize>;

struct Keypoints {
  std::vector<Eigen::Vector2f> pixel;     // raw, distorted image, level-0 pixels
  std::vector<std::uint8_t> level;        // pyramid level
  std::vector<float> angle;               // orientation in radians, in the image plane, x towards y
  std::vector<float> sigma;               // standard deviation of `pixel`, level-0 pixels, per axis
  std::vector<Eigen::Vector3d> bearing;   // unit, camera frame
  std::vector<Descriptor> descriptor;
  std::vector<Patch> patch;

  std::size_t size() const { return pixel.size(); }
  bool empty() const { return pixel.empty(); }
  void clear();
  void reserve(std::size_t n);
};

}  // namespace bslam::feature
