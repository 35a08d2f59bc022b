#include "adjustment/pose_uncertainty.h"

#include <algorithm>

namespace bslam::adjustment {
namespace {

// Returns the index of the fixed keyframe with the most observations among those of the submap whose root is `root`,
// the older one on ties; -1 if there is none. `root_of_each`: that of the map.
int anchor_pose(std::span<const KeyframeId> root_of_each, const BundleProblem& selected,
                std::span<const int> observations, KeyframeId root) {
  int anchor = -1;
  for (std::size_t i = 0; i < selected.keyframes.size(); ++i) {
    if (selected.problem.pose_free[i] || root_of_each[selected.keyframes[i].index()] != root) continue;
    if (anchor < 0 || observations[i] > observations[static_cast<std::size_t>(anchor)]) anchor = static_cast<int>(i);
  }
  return anchor;
}

std::vector<int> observations_of_poses(const BundleProblem& selected) {
  std::vector<int> out(selected.keyframes.size(), 0);
  for (const auto& o : selected.problem.observations) ++out[static_cast<std::size_t>(o.pose)];
  return out;
}

geometry::SE3 relative_pose(const BundleProblem& selected, std::size_t pose, int anchor) {
  const auto& T_rig_world = selected.problem.T_rig_world;
  return T_rig_world[pose] * T_rig_world[static_cast<std::size_t>(anchor)].inverse();
}

}  // namespace

std::vector<int> poses_with_uncertainty(const Selection& selection, const BundleProblem& selected) {
  std::vector<int> poses;
  for (const KeyframeId k : selection.with_uncertainty) {
    const auto at = std::lower_bound(selected.keyframes.begin(), selected.keyframes.end(), k);
    poses.push_back(static_cast<int>(at - selected.keyframes.begin()));
  }
  return poses;
}

std::vector<geometry::PoseUncertainty::Effect> fixed_effects(const map::BundledMap& map, const BundleProblem& selected,
                                                             Eigen::Index columns) {
  using Effect = geometry::PoseUncertainty::Effect;
  const std::vector<int> observations = observations_of_poses(selected);
  const std::vector<KeyframeId> root = map.root_of_each();
  const auto effect = [&](std::size_t pose) {
    const Effect& own = map.keyframe(selected.keyframes[pose]).uncertainty.calibration;
    return own.cols() == columns ? own : Effect(Effect::Zero(6, columns));
  };
  std::vector<Effect> out(selected.keyframes.size(), Effect(6, 0));
  bool any = false;
  for (std::size_t i = 0; i < out.size(); ++i) {
    if (selected.problem.pose_free[i]) continue;
    out[i] = Effect::Zero(6, columns);
    const int anchor = anchor_pose(root, selected, observations, root[selected.keyframes[i].index()]);
    if (anchor == static_cast<int>(i)) continue;
    out[i] = effect(i) - relative_pose(selected, i, anchor).adjoint() * effect(static_cast<std::size_t>(anchor));
    any |= !out[i].isZero(0);
  }
  return any ? out : std::vector<Effect>{};
}

PoseUncertainties pose_uncertainties(const map::BundledMap& map, const BundleProblem& selected,
                                     std::span<const int> poses,
                                     std::span<const std::optional<geometry::PoseUncertainty>> marginals,
                                     double correlated_observations) {
  // The truncation at the bound of outliers biases both the noise and the information by this factor.
  constexpr double kTruncation = solver::kFractionLeft / solver::kVarianceLeft;
  const double factor = correlated_observations * kTruncation * kTruncation;
  const std::vector<int> observations = observations_of_poses(selected);
  const std::vector<KeyframeId> root = map.root_of_each();
  PoseUncertainties out;
  for (std::size_t i = 0; i < marginals.size(); ++i) {
    const KeyframeId k = selected.keyframes[static_cast<std::size_t>(poses[i])];
    const int anchor = anchor_pose(root, selected, observations, root[k.index()]);
    if (!marginals[i] || anchor < 0) continue;
    const geometry::SE3 T_k_anchor = relative_pose(selected, static_cast<std::size_t>(poses[i]), anchor);
    const geometry::PoseUncertainty of_adjustment{factor * marginals[i]->noise, marginals[i]->calibration};
    geometry::PoseUncertainty of_anchor =
        map.keyframe(selected.keyframes[static_cast<std::size_t>(anchor)]).uncertainty;
    if (of_adjustment.calibration.cols() == 0) of_anchor = geometry::without_calibration(of_anchor);
    out.emplace_back(k, of_adjustment + geometry::transported(of_anchor, T_k_anchor));
  }
  return out;
}

PoseUncertainties without_calibration(const map::BundledMap& map) {
  PoseUncertainties out;
  for (const KeyframeId k : map.keyframe_ids()) {
    const geometry::PoseUncertainty& uncertainty = map.keyframe(k).uncertainty;
    if (uncertainty.calibration.cols() > 0) out.emplace_back(k, geometry::without_calibration(uncertainty));
  }
  return out;
}

}  // namespace bslam::adjustment
