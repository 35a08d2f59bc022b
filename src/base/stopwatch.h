// The clock of the machine: read here, for the timing record only. No decision depends on it.
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
