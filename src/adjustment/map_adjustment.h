// Bundle adjustment of part of a map: chooses nothing, only turns what was chosen into a flat problem and the answer
// into operations of a draft. Local and global adjustment differ in what they choose.
#pragma once

#include <stop_token>

#include "adjustment/flat_problem.h"
#include "base/options.h"
#include "map/map_edit.h"

namespace bslam::adjustment {

struct AdjustmentOptions {
  int robust_iterations = 5;                    // with Huber kernel, before observations are judged
  int final_iterations = 5;                     // without it, on those that agree
  double relative_decrease = 1e-4;              // of the cost, below which it has converged
  double outlier_chi2 = solver::kChi2TwoDof95;  // squared normalised error above which an observation is removed

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("robust_iterations", self.robust_iterations, Range{0, 200}, "", "steps with Huber kernel");
    visitor("final_iterations", self.final_iterations, Range{0, 200}, "",
            "steps without it on the observations that agree");
    visitor("relative_decrease", self.relative_decrease, Range{0, 0.1}, "",
            "of the cost, below which it has converged");
    visitor("outlier_chi2", self.outlier_chi2, Range{0.1, 1e6}, "",
            "squared normalised error above which an observation goes");
  }
};

struct AdjustmentReport {
  bool done = false;                        // false: nothing to adjust, or the solver failed; the draft is as it was
  std::size_t observations = 0;             // keypoints
  std::size_t outliers = 0;                 // features removed from their landmark
  double initial_cost = 0, final_cost = 0;  // robust, before and after the robust round
};

// Adjusts the free keyframes and the landmarks with all cameras' observations, two rounds, and writes poses, positions
// and the removal of outlying observations to the draft. `sigma_px`: standard deviation of a keypoint that is not
// aligned to its landmark's patch, on its level.
AdjustmentReport adjust_map(const Selection& selection, const AdjustmentOptions& options,
                            const feature::FeatureModel& features, map::MapDraft& draft, std::stop_token stop = {});

}  // namespace bslam::adjustment
