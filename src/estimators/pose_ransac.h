// Robust estimation of the rig's pose by RANSAC, and the scoring of hypotheses that all such estimators use.
#pragma once

#include <span>

#include "base/random.h"
#include "solver/pose_problem.h"
#include "solver/pose_solver.h"

namespace bslam::estimators {

using camera::Rig;
using geometry::SE3;

// Keeps the best of the offered poses by the truncated cost over all items. Each better pose is refined over its
// inliers, because a pose from a sample has the noise of three points (LO-RANSAC; Chum, Matas and Kittler, DAGM 2003).
class PoseSearch {
 public:
  // `problem` must outlive the search, which selects its items. `bound`: maximum squared error of an inlier.
  PoseSearch(solver::PoseProblem& problem, double bound) : problem_(problem), bound_(bound) {}

  // Returns true if the pose is better than the best one so far.
  bool offer(const SE3& T_rig_world);
  const SE3& best() const { return best_; }
  double inlier_ratio();

 private:
  solver::PoseProblem& problem_;
  double bound_, cost_ = std::numeric_limits<double>::infinity();
  SE3 best_;
};

// Number of samples of three required to draw one without outliers with the given confidence at this inlier ratio.
double samples_needed(double inlier_ratio, double confidence);

struct PoseRansacOptions {
  int iterations = 200;       // maximum number of samples
  double inlier_chi2 = 25.0;  // maximum squared normalised error of an inlier during sampling
  double confidence = 0.999;  // probability of a sample without outliers at which sampling stops
};

// Seeded RANSAC for matches with many outliers: minimal samples of three observations from any cameras are solved by
// Newton's method from the initial pose; the best pose is refined by solve_pose. For motions between consecutive
// frames.
solver::PoseSolution ransac_pose(const Rig& rig, std::span<const solver::PoseObservation> observations,
                                 const SE3& T_rig_world_initial, const solver::PoseSolverOptions& options,
                                 const PoseRansacOptions& ransac, Random random);

}  // namespace bslam::estimators
