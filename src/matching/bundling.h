// Matching between the cameras of a frame with overlapping views; creates the Bundled table.
#pragma once

#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "base/options.h"
#include "base/thread_pool.h"
#include "camera/rig.h"
#include "frame/bundled_frame.h"
#include "image/pyramid.h"
#include "matching/patch_alignment.h"

namespace bslam::matching {

struct BundlingOptions {
  double min_depth_m = 0.15;   // minimum distance of a point
  int max_hamming = 64;        // maximum descriptor distance of a match, of 256 bits
  double ratio = 0.9;          // maximum ratio of best to second best descriptor distance on the epipolar curve
  double sigmas = 3.0;         // maximum distance from the epipolar curve before alignment, standard deviations
  double max_chi2 = 7.81;      // maximum squared normalised error of an aligned keypoint to its feature's point
  double min_parallax = 5e-4;  // rad, minimum parallax of a feature with a point (about a quarter pixel)

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("min_depth_m", self.min_depth_m, Range{0.01, 100}, "m",
            "minimum distance of a point matched between cameras", OptionNote{.common = true, .formerly = "near_m"});
    visitor("max_hamming", self.max_hamming, Range{1, 256}, "bits",
            "maximum descriptor distance of a match between cameras");
    visitor("ratio", self.ratio, Range{0.1, 1}, "",
            "maximum ratio of best to second best descriptor distance on the epipolar curve");
    visitor("sigmas", self.sigmas, Range{0.5, 20}, "",
            "maximum distance from the epipolar curve in standard deviations");
    visitor("max_chi2", self.max_chi2, Range{0.1, 1000}, "",
            "maximum squared normalised error of a keypoint to its feature's point");
    visitor("min_parallax", self.min_parallax, Range{0, 1}, "rad",
            "minimum parallax of a matched feature to triangulate its point");
  }
};

// Matches the cameras of every overlapping pair, aligns the second keypoint of a match to the patch of the first,
// merges pairs into features of several cameras and triangulates them. A match that would give a feature two keypoints
// in one camera is dropped in favour of the stronger matches. Returns the frame with the keypoints of matched features
// at their aligned positions, their grids and the Bundled table. `rig`: the rig during the capture of the frame
// (frame::rig_of). Images captured at different times are not matched while the motion is unknown. `pyramids` and
// `alignment`: one per camera; the pyramids are those of the extraction.
frame::BundledFrame bundle(const camera::Rig& rig, const frame::BundledFrame& extracted,
                           std::span<const image::Pyramid> pyramids, const BundlingOptions& options,
                           std::span<const AlignmentOptions> alignment, ThreadPool& pool);

// The Bundled table for given groups of keypoints of the same point. A group must have at most one keypoint per camera,
// in order of camera. It gets a point if its rays have enough parallax and no squared normalised error exceeds
// `max_chi2`.
frame::Bundled make_bundled(const camera::Rig& rig, std::span<const frame::CameraFrame> cameras,
                            std::span<const std::vector<frame::KeypointRef>> matched, double min_parallax,
                            double max_chi2);

// Point of one group of keypoints of a frame, in the rig frame, or nullopt; see estimate_point.
std::optional<frame::BundledPoint> triangulate_group(const camera::Rig& rig,
                                                     std::span<const frame::CameraFrame> cameras,
                                                     std::span<const frame::KeypointRef> group, double min_parallax,
                                                     double max_chi2);

}  // namespace bslam::matching
