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
  double rpe_delta_s = 1.0;       // time interval of the relative errors; > 0
};

// Statistics of a set of non-negative errors; NaN if the set is empty.
struct ErrorStatistics {
  double rmse = std::numeric_limits<double>::quiet_NaN();
  double mean = std::numeric_limits<double>::quiet_NaN();
  double median = std::numeric_limits<double>::quiet_NaN();  // for an even number: mean of the two middle values
  double max = std::numeric_limits<double>::quiet_NaN();
  std::size_t count = 0;
};

ErrorStatistics statistics_of(std::vector<double> errors);

// Relative errors over the time `delta_s`. Each associated pose i is paired with the later pose j whose time
// difference, by the estimate's timestamps, is nearest to delta_s (the earlier one on ties). The pair is used only if
// that difference deviates from delta_s by no more than half the median interval between associated poses and no more
// than a tenth of delta_s; otherwise the nearest frame is missing (a gap or the end of the trajectory). The error of a
// pair is E = (Q_i^-1 Q_j)^-1 (P_i^-1 P_j), with ground truth Q and estimate P, both as compared (with Sim(3)
// alignment, after scaling). For frames at equal time intervals these are all pairs (i, i + n).
struct RelativeErrors {
  double delta_s = 1.0;
  ErrorStatistics translation_m;
  ErrorStatistics rotation_deg;
};

// The error of one compared pose.
struct PoseError {
  TimeNs time_ns = 0;       // time of the estimated pose
  double position_m = 0.0;  // distance between the aligned position and the ground truth
};

struct TrajectoryEvaluation {
  ErrorStatistics ate;  // errors of the positions after alignment, in metres
  RelativeErrors rpe;
  // Scale of the best Sim(3) alignment, whichever alignment was requested: truth = scale * estimate. Empty if the
  // positions do not determine it, because one trajectory is motionless.
  std::optional<double> scale;
  double coverage = 0.0;          // see `coverage`
  double coverage_of_part = 0.0;  // the same of the ground truth from the first to the last estimated pose
  double gt_length_m = 0.0;       // path length of the whole ground truth
  geometry::Sim3 T_gt_estimate;   // the alignment that was applied
  Trajectory aligned_estimate;    // all poses of the estimate, in the world frame of the ground truth
  std::vector<PoseError> errors;  // in order of time
};

// Compares two trajectories of the same frame (camera 0 or body), each in its own world frame. Returns an Error (with
// empty file) if fewer than three poses are associated, or if the scale is free and all positions of one trajectory are
// equal.
Result<TrajectoryEvaluation> evaluate(const Trajectory& estimate, const Trajectory& ground_truth,
                                      const EvaluationOptions& options);

// Fraction of the input frames with ground truth that have an estimated pose, in [0, 1]. The input frames are not
// stored in the files, so they are inferred. If the ground truth is no denser than the estimate (median interval at
// least 3/4 of the estimate's), its poses represent the frames, and the result is the fraction of them with an
// estimated pose. If it is denser, the frames are times at the estimate's median interval, laid through the gaps of the
// estimate and beyond both its ends, that have ground truth within max_dt. Frames lost at such regular intervals that
// the estimate's median interval grows cannot be distinguished from a slower camera.
double coverage(const Trajectory& estimate, const Trajectory& ground_truth, std::span<const Association> pairs,
                TimeNs max_dt_ns);

}  // namespace bslam::evaluation
