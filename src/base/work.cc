#include "base/work.h"

#include <atomic>

namespace bslam {
namespace {

std::atomic<std::uint64_t> g_images = 0, g_keypoints = 0, g_solver_steps = 0;

}  // namespace

void count_extraction(std::uint64_t keypoints) {
  g_images.fetch_add(1, std::memory_order_relaxed);
  g_keypoints.fetch_add(keypoints, std::memory_order_relaxed);
}

void count_solver_steps(std::uint64_t steps) { g_solver_steps.fetch_add(steps, std::memory_order_relaxed); }

WorkCounts work_so_far() { return {g_images, g_keypoints, g_solver_steps}; }

}  // namespace bslam
