// Tests against images whether a calibration file was read in the convention that was meant. Features that two cameras
// observe at the same time must satisfy their epipolar geometry. It is tested under the calibration as given and under
// common mistakes such as inverted transforms. Unlike the refinement of a rig (rig_refinement.h), it needs neither a
// map nor a calibration that is nearly right.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "camera/rig.h"
#include "feature/keypoints.h"
#include "image/image_bundle.h"

namespace bslam::calibration {

// Interpretations of the transforms of a calibration file.
enum class Convention {
  kAsGiven,
  kInverse,         // every transform is inverted: the file holds T_cam_body instead of T_body_cam
  kPairInverse,     // the transform between the two cameras is inverted
  kSwapped,         // the images or the calibrations of the two cameras are exchanged
  kSwappedInverse,  // exchanged cameras and inverted transforms
  kMirrored,        // the images of both cameras are mirrored, left to right
  kUpsideDown       // the images of both cameras are rotated by 180 degrees
};
constexpr int kConventions = 7;
std::string_view convention_in_words(Convention convention);

// A relative pose of the two cameras that is consistent with clearly more matches than any convention.
struct OtherPose {
  int agreeing = 0;          // matches consistent with it
  double rotated_deg = 0;    // angle between the estimated and the given orientation of the second camera
  double displaced_deg = 0;  // angle between the estimated and the given direction of the baseline; 0 without baseline

  // Returns true if the difference is too large for a camera that was bumped.
  bool is_another_arrangement() const;
};

// The calibrations of two other cameras of the rig, or of one of the pair and another one, that are consistent with
// clearly more matches than any convention: cameras of more than this pair were exchanged.
struct OtherCalibrations {
  std::array<std::string, 2> cameras;  // names, for the first and the second camera of the pair
  int agreeing = 0;                    // matches consistent with them
};

// A camera whose images are mirrored, left to right: only if they are mirrored again, matches are consistent with the
// calibration as given.
struct MirroredCamera {
  std::size_t camera = 0;
  int matches = 0, agreeing = 0;  // with the images mirrored again
};

// Evidence on one pair of cameras.
struct PairEvidence {
  std::size_t first = 0, second = 0;
  int instants = 1;                             // times at which both cameras have an image
  double overlap = 1;                           // largest fraction of the view of one that the other observes as well
  int matches = 0;                              // feature matches, over all frames
  std::array<int, kConventions> agreeing = {};  // matches consistent with each convention
  // The convention with most consistent matches, if there are enough of them and, for any but kAsGiven, clearly more
  // than as given. Empty if there is too little evidence or if one of the following is set.
  std::optional<Convention> verdict = {};
  std::optional<OtherCalibrations> exchanged = {};
  std::optional<OtherPose> other = {};
  std::optional<MirroredCamera> mirrored = {};

  int with(Convention convention) const { return agreeing[static_cast<std::size_t>(convention)]; }
  bool is_judged() const { return verdict || exchanged || other || mirrored; }
  // Whether about as many matches are consistent with the one as with the other: for cameras side by side and without
  // rotation, exchanged cameras, mirrored images and images that are upside down look the same.
  bool fit_as_well(Convention a, Convention b) const;
};

// If the share of consistent matches is smaller, another pose of the cameras is searched for.
constexpr double kGoodShare = 0.6;
// Cameras whose views overlap by less (PairEvidence::overlap) are hardly expected to have matches.
constexpr double kSomeOverlap = 0.2;

// Tests the pair (i, j) with keypoints of images taken at the same times. `of_i` and `of_j` have one entry per frame.
PairEvidence judge_pair(const camera::Rig& rig, std::size_t i, std::size_t j, std::span<const feature::Detections> of_i,
                        std::span<const feature::Detections> of_j);

// Tests every pair of cameras (i, j), i < j, with the images that they took at the same time. A few frames spread over
// a recording suffice. Pairs with overlap that have no verdict are tested with mirrored images as well. `masks` has
// one image per camera, empty or of its resolution; keypoints where it is 0 are ignored.
std::vector<PairEvidence> check_conventions(const camera::Rig& rig, std::span<const image::ImageBundle> frames,
                                            std::span<const image::Image> masks);

// The evidence on a pair in words, such as "90 of 100 matches are consistent with the calibration as given".
std::string describe_pair(const PairEvidence& pair);

// The report for users: one line per pair and a conclusion, which says how many pairs could be tested and why the
// others could not. Warns of pairs with much overlap that could not be tested.
std::string describe_evidence(std::span<const PairEvidence> evidence);

}  // namespace bslam::calibration
