// The keypoints of one camera: parallel arrays, one entry per keypoint.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "base/shared_array.h"
#include "feature/patches.h"

namespace bslam::feature {

using Descriptor = std::array<std::uint64_t, 4>;  // 256 binary tests

// The keypoints that an extractor detects in one image.
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

// Refined positions of all keypoints of a camera.
struct Refinement {
  std::vector<Eigen::Vector2f> pixel;
  std::vector<Eigen::Vector3d> bearing;
  std::vector<float> sigma;
};

// The memory of keypoints.
struct KeypointMemory {
  std::size_t positions = 0;  // pixels, bearings, standard deviations, levels, angles
  std::size_t descriptors = 0, patches = 0;
};

// The keypoints of one camera in a frame. Immutable: a stage that refines positions creates another value with
// `refined`, which shares all other arrays with this one.
struct Keypoints {
  // As detected.
  SharedArray<std::uint8_t> level;
  SharedArray<float> angle;
  SharedArray<Descriptor> descriptor;

  // Refined or, if not refined, detected positions. `sigma` is the standard deviation, per axis and in level-0 pixels,
  // of `pixel` as an observation of the point shown by the keypoint's reference patch. This patch depends on the
  // alignment of the keypoint:
  // - not aligned: its own patch; sigma is the detector's standard deviation;
  // - aligned to the first keypoint of the same feature in another camera of the frame (frame/bundled.h): the patch of
  //   that keypoint; sigma is valid between cameras of the frame;
  // - aligned to a landmark (tracking): the patch of the landmark's reference keypoint; sigma is valid for that
  //   landmark.
  // For any other point the detector's standard deviation applies (FeatureModel::sigma).
  SharedArray<Eigen::Vector2f> pixel;
  SharedArray<Eigen::Vector3d> bearing;
  SharedArray<float> sigma;

  // Patches sampled at the detected pixels; in a keyframe at the refined pixels. Old keyframes keep only the patches
  // that can still be needed (map::BundledMap::release_unused).
  Patches patch;

  Keypoints() = default;
  Keypoints(
      Detections&& detected);  // NOLINT(google-explicit-constructor): detections are keypoints that are not refined

  std::size_t size() const { return pixel.size(); }
  bool empty() const { return pixel.empty(); }
  // Memory of the arrays that were not counted before.
  KeypointMemory memory(MemoryCount& count) const;

  // A copy of the positions, and these keypoints with other positions (one for each keypoint).
  Refinement positions() const { return {pixel.copy(), bearing.copy(), sigma.copy()}; }
  Keypoints refined(Refinement&& refinement) const;
};

}  // namespace bslam::feature
