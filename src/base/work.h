// Counts of the work done by this process. Unlike times they are exact, so benchmarks can compare them between runs.
// They are only used in reports; no result depends on them.
#pragma once

#include <cstdint>

namespace bslam {

struct WorkCounts {
  std::uint64_t images = 0;        // images from which keypoints were extracted
  std::uint64_t keypoints = 0;     // extracted keypoints
  std::uint64_t solver_steps = 0;  // steps of nonlinear least squares, accepted or rejected

  friend WorkCounts operator-(const WorkCounts& a, const WorkCounts& b) {
    return {a.images - b.images, a.keypoints - b.keypoints, a.solver_steps - b.solver_steps};
  }
};

// All functions are thread-safe.
void count_extraction(std::uint64_t keypoints);
void count_solver_steps(std::uint64_t steps);
WorkCounts work_so_far();

// Highest level of reduced work per frame; 0: no reduction. See tracking/reduced_work.h.
inline constexpr int kMaxReduction = 3;

}  // namespace bslam
