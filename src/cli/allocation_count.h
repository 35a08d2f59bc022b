// Counts the heap allocations of this process by `new`.
#pragma once

#include <cstdint>
#include <functional>

namespace bslam::cli {

// Begins to count, and returns a function that returns the number of allocations by `new` in all threads since then;
// an empty function in builds with sanitizers, which have an allocator of their own. Allocations by `malloc`, such as
// those of C libraries and of Eigen's matrices of variable size, are not among them. Before the first call an
// allocation costs the test of a flag.
std::function<std::uint64_t()> begin_counting_allocations();

}  // namespace bslam::cli
