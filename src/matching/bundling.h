// From the keypoints of N cameras to the Bundled table: cross-camera matching in overlapping views.
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
  double near_m = 0.15;        // closest point that is searched for
  int max_hamming = 64;        // descriptor distance of a match, of 256 bits
  double ratio = 0.9;          // best to second best descriptor distance elsewhere on the epipolar curve
  double sigmas = 3.0;         // distance from the epipolar curve before alignment, in standard deviations
  double max_chi2 = 7.81;      // squared normalised error of an aligned keypoint against its feature's point (worst
                               // keypoint of a feature)
  double min_parallax = 5e-4;  // radians: below it a matched feature has no point (about a quarter pixel)

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("near_m", self.near_m, Range{0.01, 100}, "m", "closest point that is searched for across cameras");
    visitor("max_hamming", self.max_hamming, Range{1, 256}, "bits",
            "largest descriptor distance of a cross-camera match");
    visitor("ratio", self.ratio, Range{0.1, 1}, "", "best to second best descriptor distance on the epipolar curve");
    visitor("sigmas", self.sigmas, Range{0.5, 20}, "", "distance from the epipolar curve in standard deviations");
    visitor("max_chi2", self.max_chi2, Range{0.1, 1000}, "",
            "squared normalised error of a keypoint against its feature's point");
    visitor("min_parallax", self.min_parallax, Range{0, 1}, "rad", "least parallax of a feature that gets a point");
  }
};

// Standard deviation of a detected, not aligned keypoint: `sigma_px` on its level, in level-0 pixels.
struct DetectionNoise {
  double sigma_px = 0.4;
};

// Matches the cameras of every overlapping pair, aligns the second keypoint of a match to the patch of the first,
// merges pairs into features of several cameras (at most one keypoint per camera, else the weaker edge goes) and
// triangulates them. Takes a frame as extracted and returns it with the keypoints of matched features at their aligned
// positions, the grids and the Bundled table. `rig` is the rig as it stood when the frame was taken (frame::rig_of);
// `pyramids` and `alignment` hold one per camera, the pyramids as extracted.
frame::BundledFrame bundle(const camera::Rig& rig, const frame::BundledFrame& extracted,
                           std::span<const image::Pyramid> pyramids, const BundlingOptions& options,
                           std::span<const AlignmentOptions> alignment, ThreadPool& pool);

// The Bundled table for given groups of keypoints of the same thing (each with at most one keypoint per camera, in
// order of camera): each gets its point where the rays allow and none of its keypoints misses it by more than
// `max_chi2`.
frame::Bundled make_bundled(const camera::Rig& rig, std::span<const frame::CameraFrame> cameras,
                            std::span<const std::vector<frame::KeypointRef>> matched, double min_parallax,
                            double max_chi2);

// Point of one group of keypoints of a frame, in the rig frame; see estimate_point.
std::optional<frame::BundledPoint> triangulate_group(const camera::Rig& rig,
                                                     std::span<const frame::CameraFrame> cameras,
                                                     std::span<const frame::KeypointRef> group, double min_parallax,
                                                     double max_chi2);

}  // namespace bslam::matching
