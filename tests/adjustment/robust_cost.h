// The cost that an adjustment of a map decreases.
#pragma once

#include "adjustment/bundle_problem.h"

namespace bslam::adjustment {

// Robust cost of the selected observations in `observed` with the calibration, poses and positions of `map`, a later
// version of it.
inline double robust_cost(const map::BundledMap& observed, const Selection& selection,
                          const feature::FeatureModel& features, const map::BundledMap& map) {
  BundleProblem selected = build_problem(observed, selection, features);
  selected.problem.rig = &map.rig();
  for (std::size_t i = 0; i < selected.keyframes.size(); ++i)
    selected.problem.T_rig_world[i] = map.keyframe(selected.keyframes[i]).T_rig_world;
  for (std::size_t i = 0; i < selected.landmarks.size(); ++i)
    selected.problem.points[i] = map.landmark(selected.landmarks[i]).position;
  double cost = 0;
  for (const double chi2 : solver::squared_errors(selected.problem))
    cost += 0.5 * solver::kernel_cost(solver::Kernel::kHuber, chi2);
  return cost;
}

}  // namespace bslam::adjustment
