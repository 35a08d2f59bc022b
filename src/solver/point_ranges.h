// Loops over the points of a bundle adjustment, on one or several threads with the same result.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "base/thread_pool.h"
#include "solver/bundle_structure.h"

namespace bslam::solver {

// Consecutive points of a BundleStructure, and their first group and term. What is computed for each point of a range
// remains in scratch memory until it has been added to sums over points. Only the first step is divided by points; the
// second one is divided by sums, each of which adds all points in their order. So no sum depends on the number of
// threads, not even by rounding.
struct PointRange {
  std::size_t begin = 0, end = 0;
  std::size_t first_group = 0, first_term = 0;
};

// The ranges of all points: each has about as many observations as the caches can hold.
inline std::vector<PointRange> point_ranges(const BundleStructure& structure) {
  constexpr std::size_t kTerms = 2048;
  std::vector<PointRange> out;
  const auto first_term = [&](std::size_t point) {
    return structure.groups[structure.points[point].first_group].first_term;
  };
  for (std::size_t i = 0; i < structure.num_points(); ++i) {
    if (out.empty() || first_term(i) >= out.back().first_term + kTerms)
      out.push_back({i, i, structure.points[i].first_group, first_term(i)});
    out.back().end = i + 1;
  }
  return out;
}

// Calls body(i) for each point of a range. `pool`: null for the calling thread alone.
template <class Body>
void for_each_point(const PointRange& range, ThreadPool* pool, const Body& body) {
  const auto run = [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) body(i);
  };
  if (pool == nullptr) return run(range.begin, range.end);
  const std::size_t points = range.end - range.begin;
  const std::size_t parts = std::min(points, 4 * static_cast<std::size_t>(pool->size()));
  pool->for_each(parts,
                 [&](std::size_t k) { run(range.begin + points * k / parts, range.begin + points * (k + 1) / parts); });
}

// Calls body(share, shares) once for each thread.
template <class Body>
void for_each_share(ThreadPool* pool, const Body& body) {
  if (pool == nullptr) return body(std::size_t{0}, std::size_t{1});
  const auto shares = static_cast<std::size_t>(pool->size());
  pool->for_each(shares, [&](std::size_t share) { body(share, shares); });
}

}  // namespace bslam::solver
