// Are the extrinsics of a rig those of its images? Tested by the epipolar geometry of features that two cameras see at
// one instant, under the calibration as it is and under the slips people make with it.
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

// What may be meant by the numbers of a calibration file.
enum class Convention {
  kAsGiven,
  kInverse,        // T_cam_body stands where T_body_cam is meant
  kPairInverse,    // the same of the transform between the two cameras
  kSwapped,        // the images of the two cameras, or their calibrations, are exchanged
  kSwappedInverse  // both
};
constexpr int kConventions = 5;
std::string_view convention_in_words(Convention convention);

// The pose of the second camera seen from the first that clearly more matches fit than any convention, where there is
// one.
struct OtherPose {
  int agreeing = 0;       // matches that fit it
  double turned_deg = 0;  // of the second camera from how it is given
  double displaced_deg =
      0;  // between the directions in which it lies from the first, found and given; 0 without baseline
};

// One pair of cameras.
struct PairEvidence {
  std::size_t first = 0, second = 0;
  int instants = 1;                             // at which both were taken
  int matches = 0;                              // features found in both images, over all frames
  std::array<int, kConventions> agreeing = {};  // of them, those that fit a convention
  // The one that most fit, where enough do and clearly more than as given; empty: too little to tell, or `other`.
  std::optional<Convention> verdict = {};
  std::optional<OtherPose> other = {};
};

// Judges the pair (i, j) by keypoints of images taken at the same instants, one entry per frame for each camera.
PairEvidence judge_pair(const camera::Rig& rig, std::size_t i, std::size_t j, std::span<const feature::Detections> of_i,
                        std::span<const feature::Detections> of_j);

// Judges every pair of cameras by a few frames spread over the data set, as far as both were taken at one instant.
// Masks count. Errors: a mask that cannot be read.
Result<std::vector<PairEvidence>> check_extrinsics(const dataset::Dataset& dataset);

// A line for every pair, and one for what to do.
std::string describe_evidence(std::span<const PairEvidence> evidence);

}  // namespace bslam::session
