#include "tracking/robust_pose.h"

#include <algorithm>

#include "estimators/pose_ransac.h"

namespace bslam::tracking {
namespace {

constexpr std::size_t kTrusted = 3;  // number of keyframes beyond which more do not count
// Fractions of the matches below which a second pose is estimated, and a third one by RANSAC.
constexpr double kFewInliers = 0.8, kMinority = 0.5;
// Maximum squared normalised error, at the initial pose, of the matches that agree with it: four standard deviations.
constexpr double kAgreesWithStart = 16.0;

// Ratio of supports from which on another pose is another motion and not a variation of the first one.
constexpr double kMoreSupport = 1.1;

bool few(const solver::PoseSolution& solution, double fraction, std::size_t matches) {
  return !solution.ok || solution.num_inliers < fraction * static_cast<double>(matches);
}

void replace_if_better(const map::BundledMap& map, const FrameMatches& matches, solver::PoseSolution other,
                       solver::PoseSolution& solution) {
  if (!other.ok) return;
  if (!solution.ok || support(map, matches, other.inlier) > kMoreSupport * support(map, matches, solution.inlier))
    solution = std::move(other);
}

}  // namespace

int support(const map::BundledMap& map, const FrameMatches& matches, std::span<const std::uint8_t> inlier) {
  std::size_t sum = 0, i = 0;
  for (const auto& camera : matches) {
    for (const Match& m : camera) {
      if (inlier[i++]) sum += std::min(kTrusted, map.observations(m.landmark).size());
    }
  }
  return static_cast<int>(sum);
}

solver::PoseSolution robust_pose(const TrackInput& input, const frame::BundledFrame& frame, const FrameMatches& matches,
                                 std::span<const solver::PoseObservation> observations, const geometry::SE3& predicted,
                                 const solver::MotionModel& motion, const solver::PoseSolverOptions& options) {
  const camera::Rig& rig = input.map.rig();
  solver::PoseSolution solution = solver::solve_pose(rig, observations, predicted, motion, options);
  if (!few(solution, kFewInliers, observations.size())) return solution;
  solver::PoseSolverOptions near_start = options;
  near_start.first_chi2 = kAgreesWithStart;
  replace_if_better(input.map, matches, solver::solve_pose(rig, observations, predicted, motion, near_start), solution);
  if (!few(solution, kMinority, observations.size())) return solution;
  const solver::PoseSolution sampled =
      estimators::ransac_pose(frame::rig_of(rig, frame), observations, predicted, options, {},
                              Random(input.seed, "pose", static_cast<std::uint64_t>(frame.id.value())));
  if (sampled.ok) {
    replace_if_better(input.map, matches,
                      solver::solve_pose(rig, observations, sampled.T_rig_world, motion, near_start), solution);
  }
  return solution;
}

}  // namespace bslam::tracking
