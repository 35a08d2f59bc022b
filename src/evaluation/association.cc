#include "evaluation/association.h"

#include <algorithm>
#include <cstdlib>

#include "base/assert.h"
#include "base/median.h"

namespace bslam::evaluation {

namespace {

TimeNs distance_ns(const TimedPose& a, const TimedPose& b) { return std::abs(a.time_ns - b.time_ns); }

}  // namespace

std::size_t nearest_in_time(const Trajectory& trajectory, TimeNs time_ns) {
  BSLAM_ASSERT(!trajectory.empty(), "the trajectory must not be empty");
  const auto after = std::ranges::lower_bound(trajectory, time_ns, {}, &TimedPose::time_ns);
  if (after == trajectory.begin()) return 0;
  const auto before = std::prev(after);
  const bool earlier = after == trajectory.end() || time_ns - before->time_ns <= after->time_ns - time_ns;
  return static_cast<std::size_t>((earlier ? before : after) - trajectory.begin());
}

std::vector<Association> associate(const Trajectory& estimate, const Trajectory& ground_truth, TimeNs max_dt_ns) {
  std::vector<Association> pairs;
  if (estimate.empty() || ground_truth.empty()) return pairs;
  if (estimate.size() <= ground_truth.size()) {
    for (std::size_t i = 0; i < estimate.size(); ++i) {
      const std::size_t k = nearest_in_time(ground_truth, estimate[i].time_ns);
      if (distance_ns(estimate[i], ground_truth[k]) <= max_dt_ns) pairs.push_back({i, k});
    }
    return pairs;
  }
  for (std::size_t k = 0; k < ground_truth.size(); ++k) {
    const std::size_t i = nearest_in_time(estimate, ground_truth[k].time_ns);
    const TimeNs distance = distance_ns(estimate[i], ground_truth[k]);
    if (distance > max_dt_ns) continue;
    if (!pairs.empty() && pairs.back().estimate == i) {
      if (distance < distance_ns(estimate[i], ground_truth[pairs.back().ground_truth])) pairs.back().ground_truth = k;
      continue;
    }
    pairs.push_back({i, k});
  }
  return pairs;
}

TimeNs median_interval_ns(const Trajectory& trajectory) {
  if (trajectory.size() < 2) return 0;
  std::vector<TimeNs> intervals;
  intervals.reserve(trajectory.size() - 1);
  for (std::size_t i = 1; i < trajectory.size(); ++i) {
    intervals.push_back(trajectory[i].time_ns - trajectory[i - 1].time_ns);
  }
  return median(std::move(intervals));
}

double path_length_m(const Trajectory& trajectory) {
  double length = 0.0;
  for (std::size_t i = 1; i < trajectory.size(); ++i) {
    length += (trajectory[i].T_world_frame.translation() - trajectory[i - 1].T_world_frame.translation()).norm();
  }
  return length;
}

Trajectory moved_to_frame(const Trajectory& trajectory, const geometry::SE3& T_frame_other) {
  Trajectory moved = trajectory;
  for (TimedPose& pose : moved) pose.T_world_frame = pose.T_world_frame * T_frame_other;
  return moved;
}

double move_to_one_frame(const geometry::SE3& T_cam_truth, bool metric, Trajectory& estimate, Trajectory& truth) {
  const double distance_m = T_cam_truth.translation().norm();
  if (metric || distance_m == 0) {
    estimate = moved_to_frame(estimate, T_cam_truth);
    return 0;
  }
  truth = moved_to_frame(truth, T_cam_truth.inverse());
  return distance_m;
}

}  // namespace bslam::evaluation
