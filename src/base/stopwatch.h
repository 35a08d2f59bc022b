// Wall-clock stopwatch, used only to record timings. No decision of the algorithm depends on it.
#pragma once

#include <chrono>

namespace bslam {

class Stopwatch {
 public:
  Stopwatch() : start_(Clock::now()) {}
  double ms() const { return std::chrono::duration<double, std::milli>(Clock::now() - start_).count(); }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point start_;
};

}  // namespace bslam
