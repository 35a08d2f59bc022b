// One feature budget for all cameras of a rig, shared by what each camera's keypoints tell about the pose.
//
// The shares are those of a D-optimal design (Kiefer & Wolfowitz, Canadian J. Math. 1960): they make the determinant of
// the pose's information I = sum_c I_c as large as the budget allows, which needs no weighing of rotation against
// translation. With what camera c tells in proportion to its keypoints the multiplicative algorithm (Silvey,
// Titterington & Torsney, Comm. Statistics A 1978) gives it the share
//     s_c' = tr(I^-1 I_c) / 6
// in the next round, here the next frame; these add up to 1. So a camera gains where many of its keypoints show
// landmarks, where those are near (only they tell about translation), and where they lie in directions the others do
// not look into. Where every camera sees enough this hardly matters: in eleven runs over four simulated sets with 3 to
// 5 cameras ATE was 0.5 to 1.15 times that with even shares, on average 1.0.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "feature/extractor.h"
#include "tracking/track.h"

namespace bslam::tracking {

// Shares of the budget after `frame` was tracked with `output`; `before`: those it was extracted with (empty: even).
// They add up to 1 and depend on the arguments alone. Cameras without an image keep theirs, doubted ones lose them; a
// lost frame draws all towards even ones.
std::vector<double> feature_shares(std::span<const double> before, const map::BundledMap& map,
                                   const frame::BundledFrame& frame, const TrackOutput& output);
// The same from the information I_c of each camera's matched keypoints about the left perturbation of T_rig_world.
// seeing[c] == 0: camera c had no image.
std::vector<double> feature_shares(std::span<const double> before, std::span<const geometry::Matrix6d> information,
                                   std::span<const std::uint8_t> seeing);

// Information of each camera's matched keypoints about the left perturbation of T_rig_world.
std::vector<geometry::Matrix6d> information_by_camera(const map::BundledMap& map, const frame::BundledFrame& frame,
                                                      const FrameMatches& matches, const geometry::SE3& T_rig_world);

// Keypoints wanted of each of `cameras` cameras, in whole numbers: half of options.per_rig evenly among those not left
// out
// (`left_out` empty: all), so that a camera in which little is known can still learn, half by `shares` (empty: even). A
// camera left out gets 0, none more than options.per_image: what it cannot take goes to the others. Where cameras are
// failing (empty: none), that bound is an even share of the rig's budget among those that are not, up to kInForOthers
// times options.per_image, so that one that is left of four sees more than it did beside them.
std::vector<int> feature_budgets(std::size_t cameras, std::span<const double> shares,
                                 std::span<const std::uint8_t> left_out, std::span<const std::uint8_t> failing,
                                 const feature::FeatureOptions& options);

}  // namespace bslam::tracking
