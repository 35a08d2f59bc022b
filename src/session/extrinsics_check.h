// Tests the extrinsics of a rig against its images. Features that two cameras see at the same time must satisfy their
// epipolar geometry. It is tested under the calibration as given and under common mistakes such as inverted transforms.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "dataset/dataset.h"
#include "feature/keypoints.h"

namespace bslam::session {

// Interpretations of the transforms of a calibration file.
enum class Convention {
  kAsGiven,
  kInverse,        // every transform is inverted: the file holds T_cam_body instead of T_body_cam
  kPairInverse,    // the transform between the two cameras is inverted
  kSwapped,        // the images or the calibrations of the two cameras are exchanged
  kSwappedInverse  // exchanged cameras and inverted transforms
};
constexpr int kConventions = 5;
std::string_view convention_in_words(Convention convention);

// A relative pose of the two cameras that is consistent with clearly more matches than any convention.
struct OtherPose {
  int agreeing = 0;          // matches consistent with it
  double turned_deg = 0;     // angle between the estimated and the given orientation of the second camera
  double displaced_deg = 0;  // angle between the estimated and the given direction of the baseline; 0 without baseline
};

// Evidence on one pair of cameras.
struct PairEvidence {
  std::size_t first = 0, second = 0;
  int instants = 1;                             // times at which both cameras have an image
  int matches = 0;                              // feature matches, over all frames
  std::array<int, kConventions> agreeing = {};  // matches consistent with each convention
  // The convention with most consistent matches, if there are enough of them and, for any but kAsGiven, clearly more
  // than as given. Empty if there is too little evidence or if `other` is set.
  std::optional<Convention> verdict = {};
  std::optional<OtherPose> other = {};
};

// Judges the pair (i, j) by keypoints of images taken at the same times. `of_i` and `of_j` have one entry per frame.
PairEvidence judge_pair(const camera::Rig& rig, std::size_t i, std::size_t j, std::span<const feature::Detections> of_i,
                        std::span<const feature::Detections> of_j);

// Judges every pair of cameras by a few frames spread over the data set, using images taken at the same time. Masked
// pixels are ignored. Errors: a mask that cannot be read.
Result<std::vector<PairEvidence>> check_extrinsics(const dataset::Dataset& dataset);

// The report for users: one line per pair and a conclusion.
std::string describe_evidence(std::span<const PairEvidence> evidence);

}  // namespace bslam::session
