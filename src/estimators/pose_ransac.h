// Robust estimation of the rig's pose by RANSAC, and the search that all such estimators share.
#pragma once

#include <span>

#include "base/random.h"
#include "solver/pose_problem.h"
#include "solver/pose_solver.h"

namespace bslam::estimators {

using camera::Rig;
using geometry::SE3;

// The best of the poses offered, by the truncated cost over all items. Each better one is refined over the items that
// agree with it, as a pose from a sample has the noise of three points (LO-RANSAC; Chum, Matas and Kittler, DAGM 2003).
class PoseSearch {
 public:
  // `problem` outlives this, which selects its items; `bound`: squared error of an item that agrees.
  PoseSearch(solver::PoseProblem& problem, double bound) : problem_(problem), bound_(bound) {}

  // True where the pose is better than the best so far.
  bool offer(const SE3& T_rig_world);
  const SE3& best() const { return best_; }
  double inlier_share();

 private:
  solver::PoseProblem& problem_;
  double bound_, cost_ = std::numeric_limits<double>::infinity();
  SE3 best_;
};

// Samples of three needed for one without outliers with the confidence asked for, at this share of inliers.
double samples_needed(double inlier_share, double confidence);

struct PoseRansacOptions {
  int iterations = 200;       // samples at most
  double inlier_chi2 = 25.0;  // squared normalised error that counts as agreement while sampling
  double confidence = 0.999;  // of having drawn one sample without outliers, given the best share so far
};

// Seeded RANSAC for correspondences with many outliers: minimal samples of three observations, from any cameras, solved
// by Newton's method from the guess; the best is refined by solve_pose. For motions between neighbouring frames.
solver::PoseSolution ransac_pose(const Rig& rig, std::span<const solver::PoseObservation> observations,
                                 const SE3& T_rig_world_guess, const solver::PoseSolverOptions& options,
                                 const PoseRansacOptions& ransac, Random random);

}  // namespace bslam::estimators
