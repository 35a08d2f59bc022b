#include "tracking/robust_pose.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "base/median.h"
#include "estimators/pose_ransac.h"
#include "frame/rig_at.h"
#include "solver/pose_problem.h"
#include "tracking/scene_agreement.h"

namespace bslam::tracking {
namespace {

// Fractions of the matches below which further poses are estimated, and one by RANSAC.
constexpr double kFewInliers = 0.8, kMinority = 0.5;
// Maximum squared normalised error, at the initial pose, of the matches that agree with it: four standard deviations.
constexpr double kAgreesWithStart = 16.0;

// Minimum ratio of supports at which another pose is a different motion and not a variation of the first one.
constexpr double kMoreSupport = 1.1;
// Minimum ratio of the supports by landmarks at which the agreement of all keypoints may change the choice. Landmarks
// determine the pose in the map. The other keypoints only determine the motion since the reference keyframe, whose pose
// may be wrong.
constexpr double kComparable = 0.75;

// A moving object is small compared with the static scene around it, however many landmarks it has. Supports are
// multiplied by the ratio of the extents of two motions, up to kMaxWider, if it is at least kWider.
constexpr double kWider = 2.0, kMaxWider = 3.0;
// Minimum number of landmarks that agree with one of two motions only, and their minimum fraction of its inliers. With
// fewer the two are variations of one motion.
constexpr std::size_t kMinOfMotion = 20;
constexpr double kFractionOfInliers = 1.0 / 3;
// Landmarks that agree with both motions belong to the one that predicts them better, if the sums of their squared
// errors differ by this number of squared standard deviations. Far landmarks agree with every motion that is short
// compared with their distance, but only the motion of the rig predicts them without a systematic error.
constexpr double kPredictsBetter = 36.0;
constexpr double kHardlyAny = 0.05;              // fraction of the landmarks of a motion that are confirmed
constexpr double kFractionOfOutliers = 1.0 / 3;  // minimum fraction of the outliers of one motion that is another one

// Minimum ratio of the support of another motion to that of the chosen one at which the choice is contested.
constexpr double kContested = 0.5;
// Of two motions that the same cameras observe: minimum number of landmarks that agree with one of them only and have
// as many of the other in the same image, as a fraction of those of the rarer motion.
constexpr double kInSameCameras = 0.5;

bool few(const solver::PoseSolution& solution, double fraction, std::size_t matches) {
  return !solution.ok || solution.num_inliers < fraction * static_cast<double>(matches);
}

// The median distance of points from their median position.
double extent(const std::vector<Eigen::Vector3d>& points) {
  Eigen::Vector3d middle;
  std::vector<double> values(points.size());
  for (int axis = 0; axis < 3; ++axis) {
    std::ranges::transform(points, values.begin(), [&](const Eigen::Vector3d& p) { return p[axis]; });
    middle[axis] = median(values);
  }
  std::ranges::transform(points, values.begin(), [&](const Eigen::Vector3d& p) { return (p - middle).norm(); });
  return median(values);
}

// The poses of a frame from which one is chosen.
class PoseChoice {
 public:
  // `rig` and `motion` are those of solver::solve_pose; `motion` may be null.
  PoseChoice(const TrackInput& input, const frame::BundledFrame& frame, const FrameMatches& matches,
             std::span<const solver::PoseObservation> observations, const camera::Rig& rig,
             const solver::MotionModel* motion, const geometry::SE3& predicted, solver::PoseSolution first)
      : map_(input.map), matches_(matches), observations_(observations), rig_(rig), motion_(motion) {
    if (newly_started(input, frame))
      scene_.emplace(input, frame, observations, predicted);
    else
      confirmed_ = confirmed_landmarks(map_, input.state, matches);
    const Support of_first = first.ok ? support_of(first) : Support();
    candidates_.push_back({std::move(first), of_first});
  }

  void consider(solver::PoseSolution other) {
    if (!other.ok) return;
    const Support of_other = support_of(other);
    candidates_.push_back({std::move(other), of_other});
    if (!best().ok || clearly_better(candidates_.back())) {
      best_ = candidates_.size() - 1;
      return;
    }
    // Of three motions, each changes the comparison of the other two.
    for (std::size_t k = candidates_.size() - 1; k-- > 0;) {
      if (k != best_ && candidates_[k].solution.ok && clearly_better(candidates_[k])) best_ = k;
    }
  }

  const solver::PoseSolution& best() const { return candidates_[best_].solution; }

  // The observations of confirmed landmarks; none if the map is new.
  std::vector<solver::PoseObservation> confirmed() const {
    std::vector<solver::PoseObservation> out;
    for (std::size_t i = 0; i < confirmed_.size(); ++i) {
      if (confirmed_[i]) out.push_back(observations_[i]);
    }
    return out;
  }

  ChosenPose chosen() && {
    ChosenPose out;
    out.matches = observations_.size() - matches_of_other_motions();
    const double half = kContested * candidates_[best_].support.sum();
    for (const Candidate& other : candidates_) {
      if (!best().ok || !other.solution.ok || !same_cameras_observe(other.solution)) continue;
      out.contest.contested |= other.support.sum() > half;
      out.contest.undecided |= weighted_support(other).sum() > half;
    }
    out.solution = std::move(candidates_[best_].solution);
    return out;
  }

 private:
  struct Support {
    LandmarkSupport landmarks;
    double scene = 0.0;
    double sum() const { return landmarks.sum() + scene; }
    // Landmarks observed for a long time are evidence whatever their extent.
    void scale(double factor) {
      landmarks.spread *= factor;
      scene *= factor;
    }
  };

  struct Candidate {
    solver::PoseSolution solution;
    Support support;
  };

  Support support_of(const solver::PoseSolution& solution) const {
    return {support(map_, matches_, observations_, solution.inlier, confirmed_),
            scene_ ? kCellSupport * scene_->agreeing_cells(solution.T_rig_world) : 0.0};
  }

  Support weighted_support(const Candidate& other) const {
    Support weighted = other.support;
    weighted.scale(relative_extent(other.solution));
    return weighted;
  }

  bool clearly_better(const Candidate& other) const {
    const Support& of_best = candidates_[best_].support;
    const Support weighted = weighted_support(other);
    return weighted.landmarks.sum() >= kComparable * of_best.landmarks.sum() &&
           weighted.sum() > kMoreSupport * of_best.sum();
  }

  // The number of outliers of the best pose that are inliers of other motions.
  std::size_t matches_of_other_motions() const {
    if (!best().ok) return 0;
    std::vector<std::uint8_t> of_others(observations_.size());
    for (const Candidate& other : candidates_) {
      if (!other.solution.ok || !are_two_motions(num_exclusive(other.solution, best()), other.solution,
                                                 num_exclusive(best(), other.solution)))
        continue;
      for (std::size_t i = 0; i < of_others.size(); ++i) of_others[i] |= is_exclusive(i, other.solution, best());
    }
    return static_cast<std::size_t>(std::ranges::count(of_others, std::uint8_t{1}));
  }

  // Whether another pose and the best one are those of two motions that the same cameras observe. If each agrees with
  // other cameras, a camera is late or displaced.
  bool same_cameras_observe(const solver::PoseSolution& other) const {
    std::vector<std::size_t> of_other(matches_.size()), of_best(matches_.size());
    for (std::size_t i = 0; i < observations_.size(); ++i) {
      const std::size_t camera = observations_[i].camera.index();
      of_other[camera] += is_exclusive(i, other, best());
      of_best[camera] += is_exclusive(i, best(), other);
    }
    std::size_t sum_other = 0, sum_best = 0, common = 0;
    for (std::size_t c = 0; c < matches_.size(); ++c) {
      sum_other += of_other[c];
      sum_best += of_best[c];
      common += std::min(of_other[c], of_best[c]);
    }
    return are_two_motions(sum_other, other, sum_best) &&
           static_cast<double>(common) >= kInSameCameras * static_cast<double>(std::min(sum_other, sum_best));
  }

  // The factor by which the support of another pose counts more or less than that of the best one: the ratio of the
  // extents in space of the landmarks that belong to only one of the two. If those of one motion only are nearly all
  // unconfirmed, this decides, and not the extent.
  double relative_extent(const solver::PoseSolution& other) const {
    std::vector<Eigen::Vector3d> of_other = exclusive(other, best()), of_best = exclusive(best(), other);
    add_shared(other, of_other, of_best);
    if (!are_two_motions(of_other.size(), other, of_best.size())) return 1.0;
    if (is_unconfirmed(other, best()) != is_unconfirmed(best(), other)) return 1.0;
    const double ratio = extent(of_other) / extent(of_best);
    if (!(ratio >= kWider || ratio <= 1.0 / kWider)) return 1.0;  // also if both extents are zero
    // Outliers that are no motion agree with another pose by chance, and are spread widely.
    const auto outliers = static_cast<double>(outliers_but_for_third_motions(other));
    if (ratio > 1.0 && static_cast<double>(of_other.size()) < kFractionOfOutliers * outliers) return 1.0;
    return std::clamp(ratio, 1.0 / kMaxWider, kMaxWider);
  }

  // Adds the landmarks that agree with both poses to those of the pose that predicts them clearly better, if any.
  void add_shared(const solver::PoseSolution& other, std::vector<Eigen::Vector3d>& of_other,
                  std::vector<Eigen::Vector3d>& of_best) const {
    std::vector<solver::PoseObservation> shared;
    for (std::size_t i = 0; i < observations_.size(); ++i) {
      if (other.inlier[i] && best().inlier[i]) shared.push_back(observations_[i]);
    }
    if (shared.empty()) return;
    constexpr double kAll = std::numeric_limits<double>::infinity();
    const solver::PoseProblem problem(rig_, shared, motion_);
    const double chi2_other = problem.truncated_cost(other.T_rig_world, kAll, kAll);
    const double chi2_best = problem.truncated_cost(best().T_rig_world, kAll, kAll);
    const double variance = std::min(chi2_other, chi2_best) / (2.0 * static_cast<double>(shared.size()));
    if (!(std::abs(chi2_other - chi2_best) > kPredictsBetter * variance)) return;
    std::vector<Eigen::Vector3d>& owner = chi2_other < chi2_best ? of_other : of_best;
    for (const solver::PoseObservation& o : shared) owner.push_back(o.point_world);
  }

  // Whether hardly any landmark that agrees with a pose but not with another is confirmed.
  bool is_unconfirmed(const solver::PoseSolution& with, const solver::PoseSolution& without) const {
    std::size_t all = 0, confirmed = 0;
    for (std::size_t i = 0; i < confirmed_.size(); ++i) {
      if (!is_exclusive(i, with, without)) continue;
      ++all;
      confirmed += confirmed_[i];
    }
    return static_cast<double>(confirmed) < kHardlyAny * static_cast<double>(all);
  }

  // The number of outliers of the best pose, without those that show a motion which is neither this one nor the other.
  std::size_t outliers_but_for_third_motions(const solver::PoseSolution& other) const {
    std::vector<std::uint8_t> outlier(best().inlier.size());
    for (std::size_t i = 0; i < outlier.size(); ++i) outlier[i] = best().inlier[i] == 0;
    for (const Candidate& third : candidates_) {
      if (!third.solution.ok) continue;
      const std::vector<std::uint8_t>& inlier = third.solution.inlier;
      std::size_t of_third = 0;
      for (std::size_t i = 0; i < inlier.size(); ++i)
        of_third += inlier[i] != 0 && best().inlier[i] == 0 && other.inlier[i] == 0;
      if (!is_motion(of_third, third.solution)) continue;
      for (std::size_t i = 0; i < inlier.size(); ++i) {
        if (inlier[i] != 0 && other.inlier[i] == 0) outlier[i] = 0;
      }
    }
    return static_cast<std::size_t>(std::ranges::count(outlier, std::uint8_t{1}));
  }

  // Whether another pose and the best one are those of two motions, by the numbers of inliers of each that are not
  // inliers of the other.
  bool are_two_motions(std::size_t of_other, const solver::PoseSolution& other, std::size_t of_best) const {
    return is_motion(of_other, other) && is_motion(of_best, best());
  }

  // Whether this number of inliers that agree with no other pose shows that a pose is that of a motion of its own.
  static bool is_motion(std::size_t exclusive, const solver::PoseSolution& solution) {
    return exclusive >= kMinOfMotion && static_cast<double>(exclusive) >= kFractionOfInliers * solution.num_inliers;
  }

  // Whether observation i agrees with a pose but not with another.
  static bool is_exclusive(std::size_t i, const solver::PoseSolution& with, const solver::PoseSolution& without) {
    return with.inlier[i] != 0 && without.inlier[i] == 0;
  }

  static std::size_t num_exclusive(const solver::PoseSolution& with, const solver::PoseSolution& without) {
    std::size_t out = 0;
    for (std::size_t i = 0; i < with.inlier.size(); ++i) out += is_exclusive(i, with, without);
    return out;
  }

  // Positions of the landmarks that agree with a pose but not with another.
  std::vector<Eigen::Vector3d> exclusive(const solver::PoseSolution& with, const solver::PoseSolution& without) const {
    std::vector<Eigen::Vector3d> out;
    for (std::size_t i = 0; i < observations_.size(); ++i) {
      if (is_exclusive(i, with, without)) out.push_back(observations_[i].point_world);
    }
    return out;
  }

  const map::BundledMap& map_;
  const FrameMatches& matches_;
  std::span<const solver::PoseObservation> observations_;
  const camera::Rig& rig_;
  const solver::MotionModel* motion_;
  std::optional<SceneMatches> scene_;
  std::vector<std::uint8_t> confirmed_;  // per observation; empty if all are
  std::vector<Candidate> candidates_;
  std::size_t best_ = 0;  // index of a candidate
};

std::vector<solver::PoseObservation> outliers(const solver::PoseSolution& solution,
                                              std::span<const solver::PoseObservation> observations) {
  std::vector<solver::PoseObservation> out;
  for (std::size_t i = 0; i < observations.size(); ++i) {
    if (!solution.inlier[i]) out.push_back(observations[i]);
  }
  return out;
}

}  // namespace

bool newly_started(const TrackInput& input, const frame::BundledFrame& frame) {
  if (!input.state.anchored.known_in(input.map)) return false;
  const map::BundledKeyframe& root = input.map.keyframe(input.map.root_of(input.state.anchored.reference));
  if (root.frame == nullptr) return false;
  const double age_s = to_seconds(frame.time_ns - root.frame->time_ns);
  return age_s >= 0.0 && age_s < kLongObserved_s;
}

ChosenPose robust_pose(const TrackInput& input, const frame::BundledFrame& frame, const FrameMatches& matches,
                       std::span<const solver::PoseObservation> observations, const geometry::SE3& predicted,
                       const solver::MotionModel& motion, const solver::PoseSolverOptions& options) {
  const frame::RigAt rig_at(input.map.rig(), frame);
  const camera::Rig& rig = *rig_at;
  solver::PoseSolution first = solver::solve_pose(rig, observations, predicted, motion, options);
  if (!few(first, kFewInliers, observations.size()))
    return {.solution = std::move(first), .matches = observations.size()};
  solver::PoseSolverOptions near_start = options;
  near_start.first_chi2 = kAgreesWithStart;
  const auto pose_near = [&](const geometry::SE3& start) {
    return solver::solve_pose(rig, observations, start, motion, near_start);
  };
  const auto of_outliers = first.ok ? solver::solve_pose(rig, outliers(first, observations), predicted, motion, options)
                                    : solver::PoseSolution();
  PoseChoice choice(input, frame, matches, observations, rig, &motion, predicted, std::move(first));
  if (of_outliers.ok) choice.consider(pose_near(of_outliers.T_rig_world));
  choice.consider(pose_near(predicted));
  const auto of_confirmed = solver::solve_pose(rig, choice.confirmed(), predicted, motion, options);
  if (of_confirmed.ok) choice.consider(pose_near(of_confirmed.T_rig_world));
  if (!few(choice.best(), kMinority, observations.size())) return std::move(choice).chosen();
  const solver::PoseSolution sampled =
      estimators::ransac_pose(frame::rig_of(rig, frame), observations, predicted, options, {},
                              Random(input.seed, "pose", static_cast<std::uint64_t>(frame.id.value())));
  if (sampled.ok) choice.consider(pose_near(sampled.T_rig_world));
  return std::move(choice).chosen();
}

ChosenPose sampled_pose(const TrackInput& input, const frame::BundledFrame& frame, const FrameMatches& matches,
                        std::span<const solver::PoseObservation> observations, const geometry::SE3& predicted,
                        const solver::PoseSolverOptions& options) {
  const camera::Rig rig = frame::rig_of(input.map.rig(), frame);
  const auto sample = [&](std::span<const solver::PoseObservation> from, const char* name) {
    return estimators::ransac_pose(rig, from, predicted, options, {},
                                   Random(input.seed, name, static_cast<std::uint64_t>(frame.id.value())));
  };
  solver::PoseSolution first = sample(observations, "wide search");
  if (!few(first, kFewInliers, observations.size()))
    return {.solution = std::move(first), .matches = observations.size()};
  solver::PoseSolverOptions near_start = options;
  near_start.first_chi2 = kAgreesWithStart;
  const auto of_outliers = first.ok ? sample(outliers(first, observations), "outliers") : solver::PoseSolution();
  PoseChoice choice(input, frame, matches, observations, rig, nullptr, predicted, std::move(first));
  if (of_outliers.ok) choice.consider(solver::solve_pose(rig, observations, of_outliers.T_rig_world, near_start));
  choice.consider(solver::solve_pose(rig, observations, predicted, near_start));
  return std::move(choice).chosen();
}

}  // namespace bslam::tracking
