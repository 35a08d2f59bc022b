// Estimates the pose of the rig from matches of landmarks in any of its cameras without an initial pose, for
// relocalisation.
#pragma once

#include <span>

#include "base/random.h"
#include "solver/pose_solver.h"

namespace bslam::estimators {

using camera::Rig;
using geometry::SE3;

struct AbsolutePoseOptions {
  int iterations = 300;       // maximum number of samples; sufficient for a third of inliers
  double inlier_chi2 = 25.0;  // maximum squared normalised error of an inlier during sampling
  double confidence = 0.999;  // probability of a sample without outliers at which sampling stops
  int min_inliers = 15;  // minimum number of distinct points; in 2,000 trials, at most 6 of 130 wrong matches agreed

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("iterations", self.iterations, Range{1, 100000}, "", "maximum number of samples of three observations");
    visitor("inlier_chi2", self.inlier_chi2, Range{1, 1000}, "",
            "maximum squared normalised error of an inlier during sampling");
    visitor("confidence", self.confidence, Range{0.5, 0.999999}, "",
            "probability of a sample without outliers at which sampling stops");
    visitor("min_inliers", self.min_inliers, Range{4, 1000}, "", "minimum number of distinct inlier points of a pose");
  }
};

// Seeded RANSAC over minimal samples of three observations of different points, from any cameras: P3P (Kneip, CVPR
// 2011, by OpenGV) for a central camera, then Newton's method for the true camera positions. Solutions are scored by
// all observations, and the best one is refined as by solve_pose. The result is also not ok if fewer than `min_inliers`
// distinct points agree. Observations whose pixel has no bearing are not sampled. Deterministic.
solver::PoseSolution absolute_pose(const Rig& rig, std::span<const solver::PoseObservation> observations,
                                   const solver::PoseSolverOptions& options, const AbsolutePoseOptions& ransac,
                                   Random random);

}  // namespace bslam::estimators
