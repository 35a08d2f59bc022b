#include "tracking/pose_confirmation.h"

#include <algorithm>
#include <cmath>

#include "frame/rig_at.h"
#include "tracking/motion_prediction.h"

namespace bslam::tracking {

std::vector<double> search_windows_px(const camera::Rig& rig, const frame::BundledFrame& frame,
                                      const FrameMatches& matches, double radius, double scale_factor) {
  std::vector<double> out;
  for (std::size_t c = 0; c < matches.size(); ++c) {
    const double radius_px = radius / rig.camera(c).radians_per_pixel();
    for (const Match& m : matches[c]) {
      // The search radius is scaled by the predicted pyramid level, which may be one below that of the keypoint.
      const int level = std::max(0, frame.cameras[c].keypoints.level[m.keypoint.index()] - 1);
      out.push_back(radius_px * std::pow(scale_factor, level));
    }
  }
  return out;
}

std::vector<std::uint8_t> agreeing_beyond_chance(const camera::Rig& rig,
                                                 std::span<const solver::PoseObservation> observations,
                                                 std::span<const double> window_px, const geometry::SE3& T_rig_world,
                                                 const solver::MotionModel& motion) {
  // Minimum number of matches beyond chance, if few are expected by chance.
  constexpr double kDeviations = 5.0, kLeast = 10.0;
  const solver::PoseSolution at_pose = solver::solve_pose(rig, observations, T_rig_world, motion, {.rounds = 0});
  double expected = 0.0, variance = 0.0;
  for (std::size_t i = 0; i < observations.size(); ++i) {
    const double deviations = window_px[i] / observations[i].sigma;
    const double by_chance = std::min(1.0, solver::kChi2TwoDof95 / (deviations * deviations));
    expected += by_chance;
    variance += by_chance * (1.0 - by_chance);
  }
  const bool beyond = at_pose.num_inliers > expected + std::max(kLeast, kDeviations * std::sqrt(variance));
  return beyond ? at_pose.inlier : std::vector<std::uint8_t>(observations.size(), 0);
}

bool confirmed_by_matches(const TrackInput& input, const frame::BundledFrame& frame, const FrameMatches& matches,
                          double radius, const geometry::SE3& T_rig_world) {
  const std::vector<double> windows_px =
      search_windows_px(input.map.rig(), frame, matches, radius, input.features.pyramid.scale_factor);
  const frame::RigAt resting(input.map.rig(), frame);
  const auto agrees = agreeing_beyond_chance(*resting, pose_observations(input.map, frame, matches, input.features),
                                             windows_px, T_rig_world, motion_model(input, frame));
  return std::ranges::find(agrees, std::uint8_t{1}) != agrees.end();
}

}  // namespace bslam::tracking
