// The similarity between two rig frames from landmarks that both maps have: a closed loop where the scale has drifted,
// or the rigid motion where it has not.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "base/options.h"
#include "base/random.h"
#include "geometry/alignment.h"
#include "solver/reprojection.h"

namespace bslam::solver {

// One landmark in two maps, with one observation in each frame. One match a pair of landmarks.
struct SimilarityMatch {
  Vector3d point_a, point_b;  // in rig frame a and b, each in its own map's unit
  CameraIndex camera_a, camera_b;
  Vector2d pixel_a, pixel_b;        // raw image of camera_a in frame a, of camera_b in frame b
  double sigma_a = 1, sigma_b = 1;  // px, per axis
};

struct SimilarityRansacOptions {
  int iterations = 300;        // samples at most: enough for a third of inliers
  double sample_chi2 = 25.0;   // squared normalised error that counts as agreement while sampling
  double inlier_chi2 = 9.210;  // the 99 % bound of two degrees of freedom, in either image, at the end
  double confidence = 0.999;   // of having drawn one sample without outliers, given the best share so far
  int min_inliers = 15;        // fewer say nothing

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("iterations", self.iterations, Range{1, 100000}, "", "samples of three matches at most");
    visitor("sample_chi2", self.sample_chi2, Range{1, 1000}, "",
            "squared normalised error that counts as agreement while sampling");
    visitor("inlier_chi2", self.inlier_chi2, Range{1, 1000}, "",
            "bound of the squared normalised error of an inlier in either image");
    visitor("confidence", self.confidence, Range{0.5, 0.999999}, "", "of having drawn one sample without outliers");
    visitor("min_inliers", self.min_inliers, Range{4, 1000}, "", "fewer inliers say nothing");
  }
};

struct SimilarityEstimate {
  geometry::Sim3 S_a_b;              // scale 1 exactly where it is fixed
  std::vector<std::uint8_t> inlier;  // per match
  int num_inliers = 0;
};

// Seeded RANSAC: three matches give a hypothesis (geometry::align_points), judged by the reprojection of S_a_b point_b
// in camera_a and of S_b_a point_a in camera_b; the best is refined by Gauss-Newton over both errors of all inliers,
// which are inside the bound in both images. The rig's extrinsics hold in both units alike: where the scale differs
// much, the rig has one camera, or else it would have been observed. Empty where support does not suffice or the
// inliers leave some direction of the transform undetermined. Deterministic.
std::optional<SimilarityEstimate> ransac_similarity(const Rig& rig, std::span<const SimilarityMatch> matches,
                                                    geometry::ScaleMode scale, const SimilarityRansacOptions& options,
                                                    Random random);

}  // namespace bslam::solver
