// The pose of the rig from matches of landmarks with any of its cameras, without a guess: relocalisation.
#pragma once

#include <span>

#include "base/random.h"
#include "solver/pose_solver.h"

namespace bslam::estimators {

using camera::Rig;
using geometry::SE3;

struct AbsolutePoseOptions {
  int iterations = 300;       // samples at most: enough for a third of inliers
  double inlier_chi2 = 25.0;  // squared normalised error that counts as agreement while sampling
  double confidence = 0.999;  // of having drawn one sample without outliers, given the best share so far
  int min_inliers = 15;       // distinct points; wrong matches alone agreed in 6 at most, of 130, in 2,000 trials

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("iterations", self.iterations, Range{1, 100000}, "", "samples of three observations at most");
    visitor("inlier_chi2", self.inlier_chi2, Range{1, 1000}, "",
            "squared normalised error that counts as agreement while sampling");
    visitor("confidence", self.confidence, Range{0.5, 0.999999}, "", "of having drawn one sample without outliers");
    visitor("min_inliers", self.min_inliers, Range{4, 1000}, "", "distinct points a pose must agree with");
  }
};

// Seeded RANSAC over minimal samples of three observations of different points, from any cameras: P3P (Kneip, CVPR
// 2011, by OpenGV) as if their cameras stood in one place, then Newton's method to where they do. A solution is judged
// by all observations and the best refined as by solve_pose. Not ok also where fewer than `min_inliers` distinct points
// agree. Observations whose pixel has no bearing are never in a sample. Deterministic.
solver::PoseSolution absolute_pose(const Rig& rig, std::span<const solver::PoseObservation> observations,
                                   const solver::PoseSolverOptions& options, const AbsolutePoseOptions& ransac,
                                   Random random);

}  // namespace bslam::estimators
