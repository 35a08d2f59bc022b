#include "tracking/robust_pose.h"

#include <algorithm>

namespace bslam::tracking {
namespace {

constexpr std::size_t kTrusted = 3;  // number of keyframes beyond which more do not count
constexpr double kFewInliers = 0.8;  // fraction of the matches below which a second pose is estimated
// Maximum squared normalised error, at the prediction, of the matches that agree with it: four standard deviations.
constexpr double kAgreesWithPrediction = 16.0;

// Ratio of supports from which on the second pose is another motion and not a variation of the first one.
constexpr double kMoreSupport = 1.1;

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

solver::PoseSolution robust_pose(const map::BundledMap& map, const FrameMatches& matches,
                                 std::span<const solver::PoseObservation> observations, const geometry::SE3& predicted,
                                 const solver::MotionModel& motion, const solver::PoseSolverOptions& options) {
  solver::PoseSolution of_majority = solver::solve_pose(map.rig(), observations, predicted, motion, options);
  if (of_majority.num_inliers >= kFewInliers * static_cast<double>(observations.size())) return of_majority;
  solver::PoseSolverOptions near_prediction = options;
  near_prediction.first_chi2 = kAgreesWithPrediction;
  solver::PoseSolution of_prediction = solver::solve_pose(map.rig(), observations, predicted, motion, near_prediction);
  if (!of_prediction.ok) return of_majority;
  if (!of_majority.ok) return of_prediction;
  const bool better =
      support(map, matches, of_prediction.inlier) > kMoreSupport * support(map, matches, of_majority.inlier);
  return better ? of_prediction : of_majority;
}

}  // namespace bslam::tracking
