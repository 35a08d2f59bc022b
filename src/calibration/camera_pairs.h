// Tests after a run whether its images belong to the calibration: cameras with overlapping views must observe the same
// points, in directions that agree with the calibration. The refinement of the rig cannot test this, because it uses
// only matches that are consistent with the calibration.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calibration/convention_check.h"
#include "map/bundled_map.h"

namespace bslam::calibration {

// The features of a run that two of its cameras share.
struct CameraPair {
  std::size_t first = 0, second = 0;  // cameras of the run
  // Largest fraction of the view of one of them that the other observes as well. Parts of the images without features
  // in any keyframe, such as the corners of a fisheye's images, are not counted.
  double overlap = 0;
  int keyframes = 0;  // number of keyframes in which both have an image of the same time with enough keypoints
  // Number of keypoints in these keyframes that are in the common part of the views, for the camera with fewer of them,
  // and how many of them were matched with a keypoint of the other camera.
  double common = 0;
  int matched = 0;
  // Matches without the calibration; nullopt if enough keypoints were matched with it.
  std::optional<PairEvidence> evidence = {};
  bool contradicted = false;  // the evidence shows another arrangement of the cameras than the calibration

  // Returns true if the calibration is contradicted because the images of both cameras are mirrored.
  bool mirrored() const { return contradicted && evidence && evidence->verdict == Convention::kMirrored; }

  double matched_share() const { return common > 0 ? matched / common : 0; }
  // Returns true if the views overlap and have features, but hardly any feature was matched.
  bool hardly_matched() const;
};

// Describes a pair that is hardly matched, whose cameras have these names.
std::string describe_hardly_matched(const CameraPair& pair, const std::string& first, const std::string& second);

// Whether the evidence shows that the images do not belong to the calibration, rather than a calibration that is
// inaccurate or a camera that was bumped: nearly all matches are consistent with exchanged cameras, with inverted
// transforms, or with a pose of the second camera that has nothing to do with the calibrated one.
bool shows_another_arrangement(const PairEvidence& evidence);

// All pairs of the cameras of a run, by keyframes `keyframes` of its map. `given` and `final_rig`: the calibration of
// the run before and after its refinement, whose camera 0 is camera `first_camera` of the map. A pair is contradicted
// only if both are, or if the refinement explains its images by a baseline of another length. `suspected`: the images
// contradict the calibration, so that pairs with matches are tested as well, because a refinement can make wrong
// matches of mirrored images or exchanged cameras fit. Takes some 10 ms per pair that is tested.
std::vector<CameraPair> test_pairs(const map::BundledMap& map, std::span<const KeyframeId> keyframes,
                                   std::size_t first_camera, const camera::Rig& given, const camera::Rig& final_rig,
                                   bool suspected = false);

// The pairs that are contradicted or hardly matched, by all keyframes from `first` on: those of this run. Otherwise as
// test_pairs().
std::vector<CameraPair> disagreeing_pairs(const map::BundledMap& map, KeyframeId first, std::size_t first_camera,
                                          const camera::Rig& given, const camera::Rig& final_rig, bool suspected);

}  // namespace bslam::calibration
