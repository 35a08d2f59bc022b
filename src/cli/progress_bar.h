// A progress bar on stderr, shown only if stderr is a terminal.
#pragma once

#include <chrono>
#include <cstddef>
#include <string>

namespace bslam::cli {

class ProgressBar {
 public:
  ProgressBar(bool enabled, std::string unit);
  void show(std::size_t done, std::size_t all);  // redrawn at most ten times per second
  void finish();                                 // ends the line

 private:
  using Clock = std::chrono::steady_clock;
  bool active_;
  std::string unit_;
  Clock::time_point start_ = Clock::now(), drawn_;
};

}  // namespace bslam::cli
