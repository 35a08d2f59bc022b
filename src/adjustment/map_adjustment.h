// Bundle adjustment of a selection of the map: builds the problem, solves it, and writes the result to a draft. Local
// and global adjustment differ only in the selection.
#pragma once

#include <stop_token>

#include "adjustment/bundle_problem.h"
#include "base/options.h"
#include "map/map_edit.h"

namespace bslam::adjustment {

struct AdjustmentOptions {
  int robust_iterations = 4;                    // with Huber kernel, before outliers are classified
  int final_iterations = 5;                     // without robust kernel, on the inliers
  double relative_decrease = 1e-4;              // converged if a step decreases the cost by a smaller fraction
  double outlier_chi2 = solver::kChi2TwoDof95;  // squared normalised error above which an observation is removed
  // Number of observations of a landmark that together carry the information of one: errors of a landmark in successive
  // images are similar. For the covariances of the poses only.
  double correlated_observations = 10;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("robust_iterations", self.robust_iterations, Range{0, 200}, "", "iterations with Huber kernel");
    visitor("final_iterations", self.final_iterations, Range{0, 200}, "",
            "iterations without robust kernel, on the inliers");
    visitor("relative_decrease", self.relative_decrease, Range{0, 0.1}, "",
            "relative decrease of the cost below which the adjustment has converged");
    visitor("outlier_chi2", self.outlier_chi2, Range{0.1, 1e6}, "",
            "squared normalised error above which an observation is removed");
    visitor("correlated_observations", self.correlated_observations, Range{1, 1e4}, "",
            "number of observations that carry as much information as one, for the covariances of poses");
  }
};

// Adjusts the free keyframes and the landmarks, using the observations of all cameras, in two rounds. Writes poses with
// their uncertainties (adjustment/pose_uncertainty.h), positions and the removal of outlier observations to the draft.
// `features` determines the standard deviation of a keypoint that is not aligned to its landmark's patch. Returns false
// if there is nothing to adjust, or the solver failed; the draft is unchanged then.
bool adjust_map(const Selection& selection, const AdjustmentOptions& options, const feature::FeatureModel& features,
                map::MapDraft& draft, std::stop_token stop = {});

}  // namespace bslam::adjustment
