#include "evaluation/trajectory_error.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

#include "evaluation/trajectory_alignment.h"
#include "geometry/so3.h"

namespace bslam::evaluation {

namespace {

using geometry::SE3;
using geometry::Sim3;
using geometry::Vector3d;

// Largest deviation of the time between the poses of a pair from delta, relative to delta; matters for sparse frames.
constexpr double kRpeTolerance = 0.1;
constexpr std::size_t kMinPairs = 3;  // a rotation and a translation need three points

std::optional<Sim3> fit(const Trajectory& estimate, const Trajectory& ground_truth, std::span<const Association> pairs,
                        geometry::ScaleMode scale) {
  std::vector<Vector3d> src, dst;
  for (const Association& pair : pairs) {
    src.push_back(estimate[pair.estimate].T_world_frame.translation());
    dst.push_back(ground_truth[pair.ground_truth].T_world_frame.translation());
  }
  return align_positions(src, dst, scale);
}

RelativeErrors relative_errors(const Trajectory& aligned, const Trajectory& ground_truth,
                               std::span<const Association> pairs, double delta_s) {
  const TimeNs delta_ns = from_seconds(delta_s);
  Trajectory compared;
  for (const Association& pair : pairs) compared.push_back(aligned[pair.estimate]);
  const TimeNs tolerance_ns = std::min(from_seconds(kRpeTolerance * delta_s), median_interval_ns(compared) / 2);
  std::vector<double> translation, rotation;
  std::size_t last = 0;  // index of the first pair at or after delta; increases with i
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const TimeNs target = compared[i].time_ns + delta_ns;
    last = std::max(last, i + 1);
    while (last < pairs.size() && compared[last].time_ns < target) ++last;
    std::size_t j = last;
    const auto off = [&](std::size_t k) { return std::abs(compared[k].time_ns - target); };
    if (j == pairs.size() || (j > i + 1 && off(j - 1) <= off(j))) --j;
    if (j <= i || off(j) > tolerance_ns) continue;
    const SE3 true_motion =
        ground_truth[pairs[i].ground_truth].T_world_frame.inverse() * ground_truth[pairs[j].ground_truth].T_world_frame;
    const SE3 motion = compared[i].T_world_frame.inverse() * compared[j].T_world_frame;
    const SE3 error = true_motion.inverse() * motion;
    translation.push_back(error.translation().norm());
    rotation.push_back(geometry::degrees(geometry::so3_log(error.rotation()).norm()));
  }
  return {.delta_s = delta_s,
          .translation_m = statistics_of(std::move(translation)),
          .rotation_deg = statistics_of(std::move(rotation))};
}

// Counts the times start + k * step, k = 1 .. count, that have a ground-truth pose within `tolerance_ns`. Intervals
// without ground truth are skipped at once, so a single stray timestamp far away costs nothing.
std::size_t count_covered(const Trajectory& ground_truth, TimeNs start, double step, TimeNs count,
                          TimeNs tolerance_ns) {
  std::size_t covered = 0;
  for (TimeNs k = 1; k <= count; ++k) {
    const TimeNs t = start + std::llround(static_cast<double>(k) * step);
    const auto next = std::ranges::lower_bound(ground_truth, t - tolerance_ns, {}, &TimedPose::time_ns);
    if (next == ground_truth.end()) break;
    // time until the next pose is within the tolerance; <= 0 if it already is
    const TimeNs wait = next->time_ns - tolerance_ns - t;
    if (wait <= 0) {
      ++covered;
    } else {
      k += std::max<TimeNs>(0, static_cast<TimeNs>(static_cast<double>(wait) / step) - 1);
    }
  }
  return covered;
}

// The number of frames between an end of the estimate and that of the ground truth. A single one is not counted: ground
// truth usually begins a little before the first image and ends a little after the last, by up to an interval.
TimeNs frames_beyond(TimeNs duration_ns, TimeNs interval_ns) {
  const TimeNs frames = std::max<TimeNs>(0, duration_ns / interval_ns);
  return frames == 1 ? 0 : frames;
}

// Counts frames with ground truth but without a pose: in the gaps of the estimate, before its first pose and after its
// last.
std::size_t count_missing_frames(const Trajectory& estimate, const Trajectory& ground_truth, TimeNs interval_ns,
                                 TimeNs max_dt_ns) {
  const TimeNs tolerance = std::min(max_dt_ns, interval_ns);
  const double interval = static_cast<double>(interval_ns);
  std::size_t missing = 0;
  for (std::size_t i = 1; i < estimate.size(); ++i) {
    const TimeNs from = estimate[i - 1].time_ns, gap = estimate[i].time_ns - from;
    const TimeNs steps = (gap + interval_ns / 2) / interval_ns;
    if (steps < 2) continue;
    missing +=
        count_covered(ground_truth, from, static_cast<double>(gap) / static_cast<double>(steps), steps - 1, tolerance);
  }
  const TimeNs first = estimate.front().time_ns, last = estimate.back().time_ns;
  const TimeNs before = frames_beyond(first - ground_truth.front().time_ns + tolerance, interval_ns);
  const TimeNs after = frames_beyond(ground_truth.back().time_ns + tolerance - last, interval_ns);
  missing += count_covered(ground_truth, first - (before + 1) * interval_ns, interval, before, tolerance);
  missing += count_covered(ground_truth, last, interval, after, tolerance);
  return missing;
}

std::string seconds_text(TimeNs duration_ns) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g s", to_seconds(duration_ns));
  return text;
}

std::string range_text(const Trajectory& trajectory) {
  if (trajectory.empty()) return "empty";
  char text[80];
  std::snprintf(text, sizeof text, "from %.3f to %.3f s", to_seconds(trajectory.front().time_ns),
                to_seconds(trajectory.back().time_ns));
  return text;
}

}  // namespace

ErrorStatistics statistics_of(std::vector<double> errors) {
  ErrorStatistics result;
  result.count = errors.size();
  if (errors.empty()) return result;
  std::ranges::sort(errors);
  double sum = 0.0, squares = 0.0;
  for (const double e : errors) {
    sum += e;
    squares += e * e;
  }
  const double n = static_cast<double>(errors.size());
  result.rmse = std::sqrt(squares / n);
  result.mean = sum / n;
  const std::size_t half = errors.size() / 2;
  result.median = errors.size() % 2 == 1 ? errors[half] : 0.5 * (errors[half - 1] + errors[half]);
  result.max = errors.back();
  return result;
}

double coverage(const Trajectory& estimate, const Trajectory& ground_truth, std::span<const Association> pairs,
                TimeNs max_dt_ns) {
  if (estimate.empty() || ground_truth.empty()) return 0.0;
  const TimeNs interval = median_interval_ns(estimate);
  if (interval <= 0 || 4 * median_interval_ns(ground_truth) >= 3 * interval) {
    std::size_t matched = 0;  // number of distinct ground-truth times; the pairs are ordered by time
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      matched += i == 0 || pairs[i].ground_truth != pairs[i - 1].ground_truth;
    }
    return static_cast<double>(matched) / static_cast<double>(ground_truth.size());
  }
  const std::size_t missing = count_missing_frames(estimate, ground_truth, interval, max_dt_ns);
  if (pairs.empty()) return 0.0;
  return static_cast<double>(pairs.size()) / static_cast<double>(pairs.size() + missing);
}

namespace {

// The ground truth from that of the first pair to that of the last one.
Trajectory part_of(const Trajectory& ground_truth, std::span<const Association> pairs) {
  const auto at = [&](std::size_t i) { return ground_truth.begin() + static_cast<std::ptrdiff_t>(i); };
  return {at(pairs.front().ground_truth), at(pairs.back().ground_truth) + 1};
}

}  // namespace

Result<TrajectoryEvaluation> evaluate(const Trajectory& estimate, const Trajectory& ground_truth,
                                      const EvaluationOptions& options) {
  const std::vector<Association> pairs = associate(estimate, ground_truth, options.max_dt_ns);
  if (pairs.size() < kMinPairs) {
    return Error{.file = {},
                 .key = {},
                 .found = std::to_string(pairs.size()) + " poses within " + seconds_text(options.max_dt_ns) +
                          " of a ground-truth pose",
                 .expected = "at least " + std::to_string(kMinPairs) + "; the estimate is " + range_text(estimate) +
                             ", the ground truth " + range_text(ground_truth)};
  }
  TrajectoryEvaluation result;
  const std::optional<Sim3> similarity = fit(estimate, ground_truth, pairs, geometry::ScaleMode::kFree);
  if (similarity) result.scale = similarity->scale();
  if (options.align != AlignMode::kNone) {
    const std::optional<Sim3> alignment = options.align == AlignMode::kSim3
                                              ? similarity
                                              : fit(estimate, ground_truth, pairs, geometry::ScaleMode::kFixed);
    if (!alignment) {
      return Error{.file = {},
                   .key = {},
                   .found = "a motionless trajectory, which does not determine the scale",
                   .expected = "a trajectory with motion, or an alignment without scale"};
    }
    result.T_gt_estimate = *alignment;
  }
  result.aligned_estimate = estimate;
  for (TimedPose& pose : result.aligned_estimate) {
    pose.T_world_frame = result.T_gt_estimate.apply_to_pose(pose.T_world_frame);
  }
  std::vector<double> distances;
  for (const Association& pair : pairs) {
    const TimedPose& pose = result.aligned_estimate[pair.estimate];
    const Vector3d& truth = ground_truth[pair.ground_truth].T_world_frame.translation();
    distances.push_back((pose.T_world_frame.translation() - truth).norm());
    result.errors.push_back({pose.time_ns, distances.back()});
  }
  result.ate = statistics_of(std::move(distances));
  result.rpe = relative_errors(result.aligned_estimate, ground_truth, pairs, options.rpe_delta_s);
  result.coverage = coverage(estimate, ground_truth, pairs, options.max_dt_ns);
  result.coverage_of_part = coverage(estimate, part_of(ground_truth, pairs), pairs, options.max_dt_ns);
  result.gt_length_m = path_length_m(ground_truth);
  return result;
}

}  // namespace bslam::evaluation
