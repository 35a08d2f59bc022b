// The keypoints of one camera: parallel arrays, one entry per keypoint.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "base/shared_array.h"

namespace bslam::feature {

using Descriptor = std::array<std::uint64_t, 4>;  // 256 binary tests

// Small window of the level a keypoint was found on, centred on the keypoint (sampled at its sub-pixel position),
// upright: what sub-pixel alignment needs once the image is gone. Row-major, kPatchSize x kPatchSize grey values at
// offsets -kPatchSize/2 + 0.5 ... in pixels of the level, so that the keypoint lies between the four middle samples.
constexpr int kPatchSize = 10;  // 8 x 8 plus a border of one for gradients
using Patch = std::array<std::uint8_t, kPatchSize * kPatchSize>;

// What an extractor finds in one image.
struct Detections {
  std::vector<Eigen::Vector2f> pixel;    // raw, distorted image, level-0 pixels
  std::vector<std::uint8_t> level;       // pyramid level
  std::vector<float> angle;              // orientation in radians, in the image plane, x towards y
  std::vector<float> sigma;              // standard deviation of `pixel`, level-0 pixels, per axis
  std::vector<Eigen::Vector3d> bearing;  // unit, camera frame
  std::vector<Descriptor> descriptor;
  std::vector<Patch> patch;

  std::size_t size() const { return pixel.size(); }
  bool empty() const { return pixel.empty(); }
  void clear();
  void reserve(std::size_t n);
};

// Better positions for all keypoints of a camera, as one stage estimates them.
struct Refinement {
  std::vector<Eigen::Vector2f> pixel;
  std::vector<Eigen::Vector3d> bearing;
  std::vector<float> sigma;
};

// The keypoints of one camera as a frame holds them. Immutable: a stage that estimates better positions makes another
// value with `refined`, which shares all other arrays with this one.
struct Keypoints {
  // As detected.
  SharedArray<std::uint8_t> level;
  SharedArray<float> angle;
  SharedArray<Descriptor> descriptor;

  // As refined last, or as detected. `sigma` is the standard deviation, per axis and in level-0 pixels, of `pixel` as
  // an observation of the point that the keypoint's reference patch shows. Which patch that is, bundling and tracking
  // decide by what they align the keypoint to:
  // - nothing: its own patch, so that sigma is the detector's;
  // - the first keypoint of its matched feature (bundling): that one's patch. sigma holds between cameras of the frame;
  // - a landmark (tracking): the patch of the landmark's reference keypoint. sigma holds against that landmark.
  // Between a keypoint and any other point the detector's standard deviation holds (FeatureModel::sigma).
  SharedArray<Eigen::Vector2f> pixel;
  SharedArray<Eigen::Vector3d> bearing;
  SharedArray<float> sigma;

  // Cut at the pixel as detected; of a keyframe at its pixel as refined.
  SharedArray<Patch> patch;

  Keypoints() = default;
  Keypoints(Detections&& detected);  // NOLINT(google-explicit-constructor): detections are not refined keypoints

  std::size_t size() const { return pixel.size(); }
  bool empty() const { return pixel.empty(); }

  // The positions, to be changed; and these keypoints at other positions.
  Refinement positions() const { return {pixel.copy(), bearing.copy(), sigma.copy()}; }
  Keypoints refined(Refinement&& refinement) const;
};

}  // namespace bslam::feature
