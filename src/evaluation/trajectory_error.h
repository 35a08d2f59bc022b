// Errors of an estimated trajectory against ground truth: absolute (ATE), relative (RPE), coverage, scale.
// Definitions after Sturm et al., "A Benchmark for the Evaluation of RGB-D SLAM Systems", IROS 2012.
#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "base/result.h"
#include "evaluation/association.h"
#include "evaluation/trajectory.h"
#include "geometry/sim3.h"

namespace bslam::evaluation {

enum class AlignMode { kNone, kSe3, kSim3 };

struct EvaluationOptions {
  AlignMode align = AlignMode::kSe3;
  TimeNs max_dt_ns = 10'000'000;  // poses further apart in time are not compared
  double rpe_delta_s = 1.0;       // the time over which relative errors are taken; > 0
};

// Over a set of non-negative errors; NaN where there is none.
struct ErrorStatistics {
  double rmse = std::numeric_limits<double>::quiet_NaN();
  double mean = std::numeric_limits<double>::quiet_NaN();
  double median = std::numeric_limits<double>::quiet_NaN();  // of an even number: mean of the two in the middle
  double max = std::numeric_limits<double>::quiet_NaN();
  std::size_t count = 0;
};

ErrorStatistics statistics_of(std::vector<double> errors);

// Relative errors over `delta_s`. From each associated pose i to the later pose j whose time difference is nearest to
// delta_s (the earlier of two equally near), by the estimate's times, if it is off by no more than half the median
// interval between associated poses and a tenth of delta_s: otherwise the frame that would be nearest is missing (a
// gap, the end), and i begins no pair. The error of a pair is E = (Q_i^-1 Q_j)^-1 (P_i^-1 P_j), Q ground truth, P
// estimate, both the poses that were compared (with Sim(3) alignment, the scaled ones). With frames at equal distances
// these are all pairs (i, i + n).
struct RelativeErrors {
  double delta_s = 1.0;
  ErrorStatistics translation_m;
  ErrorStatistics rotation_deg;
};

// One compared pose.
struct PoseError {
  TimeNs time_ns = 0;       // of the estimate
  double position_m = 0.0;  // distance of the aligned position from the true one
};

struct TrajectoryEvaluation {
  ErrorStatistics ate;  // of positions, in metres, after alignment
  RelativeErrors rpe;
  std::optional<double> scale;   // of the best Sim(3) whatever the alignment asked for: truth = scale * estimate; empty
                                 // where the positions do not determine it (one stands still)
  double coverage = 0.0;         // see `coverage`
  double gt_length_m = 0.0;      // path length of the whole ground truth
  geometry::Sim3 T_gt_estimate;  // the alignment applied
  Trajectory aligned_estimate;   // every pose of the estimate, in the world of the ground truth
  std::vector<PoseError> errors;  // in order of time
};

// Compares poses of one frame (both camera 0, or both body), each in its own world. An Error (without a file) where
// fewer than three poses are associated, or a scale is asked for and the positions of one trajectory are all the same.
Result<TrajectoryEvaluation> evaluate(const Trajectory& estimate, const Trajectory& ground_truth,
                                      const EvaluationOptions& options);

// Share of the input frames with ground truth that have an estimated pose, in [0, 1]. The input frames are not in the
// files, so they are inferred. A ground truth no denser than the estimate's frames (median interval at least 3/4 of the
// estimate's) stands for them itself: the share is that of its instants with a pose. A denser one only says where there
// is truth: the frames are then instants at the estimate's median interval, laid from its own times through its gaps
// and on to both ends, that have a ground truth within max_dt. Frames lost at so even a distance that the estimate's
// median interval grows cannot be told from a slower camera.
double coverage(const Trajectory& estimate, const Trajectory& ground_truth, std::span<const Association> pairs,
                TimeNs max_dt_ns);

}  // namespace bslam::evaluation
