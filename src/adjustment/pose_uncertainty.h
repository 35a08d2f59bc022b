// Uncertainty of the poses of keyframes relative to the root of their submap, which is the origin of its world frame.
//
// A bundle adjustment determines the pose of a keyframe relative to the fixed keyframes. The covariance M of its noise
// follows from that of the images, with all other variables marginalised out. Two corrections apply. Estimation without
// outliers makes both the remaining noise, from which the variances of the landmarks are estimated, and the information
// that the observations contain seem better than they are. And the errors of a landmark in successive images are
// similar, so that only one of several observations adds information.
//
// The errors of the fixed keyframes are added. These drift together, so the one with the most observations, the anchor
// a, represents all:
//     C_k = correlated_observations (0.95 / 0.80)^2 M + Ad(T_ka) C_a Ad(T_ka)^T        (docs/math.md, section 5)
//     F_k = F + Ad(T_ka) F_a
// where F is the effect of the calibration's error on the pose relative to the anchor, given the effects on the other
// fixed keyframes relative to it (fixed_effects). The root has F = 0,
// and C = 0 unless it was moved away from the origin (calibration::move_submap). Not included are errors of the
// velocities of the rig.
#pragma once

#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "adjustment/bundle_problem.h"

namespace bslam::adjustment {

using PoseUncertainties = std::vector<std::pair<KeyframeId, geometry::PoseUncertainty>>;

// Indices, among the poses of the problem, of the selection's keyframes `with_uncertainty`.
std::vector<int> poses_with_uncertainty(const Selection& selection, const BundleProblem& selected);

// solver::BundleOptions::fixed_effects, relative to the anchor: F_f - Ad(T_fa) F_a of each fixed keyframe f. An error
// of the scale, for example, changes their distances, although they drift together. Empty if there is at most one in
// each submap, or none has an effect.
std::vector<geometry::PoseUncertainty::Effect> fixed_effects(const map::BundledMap& map, const BundleProblem& selected,
                                                             Eigen::Index columns);

// Returns the uncertainties of T_rig_world, in radians and map units, of the keyframes at these poses. `marginals`: M
// and F of each, as in solver::BundleSummary; keyframes without one are left out. `map` has the uncertainties of the
// fixed keyframes.
PoseUncertainties pose_uncertainties(const map::BundledMap& map, const BundleProblem& selected,
                                     std::span<const int> poses,
                                     std::span<const std::optional<geometry::PoseUncertainty>> marginals,
                                     double correlated_observations);

// The uncertainties without the error of the calibration, for the keyframes whose uncertainty includes one. Used once
// the calibration has been compared with the images and is taken as exact.
PoseUncertainties without_calibration(const map::BundledMap& map);

}  // namespace bslam::adjustment
