// Counts of the work that this process has done, by which measurements of speed compare runs exactly. They are only
// read for reports: no result depends on them.
#pragma once

#include <cstdint>

namespace bslam {

struct WorkCounts {
  std::uint64_t images = 0;        // whose keypoints were extracted
  std::uint64_t keypoints = 0;     // extracted in these
  std::uint64_t solver_steps = 0;  // of nonlinear least squares, accepted or rejected

  friend WorkCounts operator-(const WorkCounts& a, const WorkCounts& b) {
    return {a.images - b.images, a.keypoints - b.keypoints, a.solver_steps - b.solver_steps};
  }
};

// All functions are thread-safe.
void count_extraction(std::uint64_t keypoints);
void count_solver_steps(std::uint64_t steps);
WorkCounts work_so_far();

// Levels of the work per frame, from 0 (all of it); see tracking/reduced_work.h.
inline constexpr int kMaxReduction = 3;

}  // namespace bslam
