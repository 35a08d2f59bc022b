// Times in data structures are integer nanoseconds. No estimate depends on the system clock, which only
// base/stopwatch.h and the pace of a run read.
#pragma once

#include <cstdint>

namespace bslam {

using TimeNs = std::int64_t;

constexpr double kSecondsPerNs = 1e-9;

constexpr double to_seconds(TimeNs duration_ns) { return static_cast<double>(duration_ns) * kSecondsPerNs; }
constexpr TimeNs from_seconds(double duration_s) {
  return static_cast<TimeNs>(duration_s * 1e9 + (duration_s < 0 ? -0.5 : 0.5));
}

}  // namespace bslam
