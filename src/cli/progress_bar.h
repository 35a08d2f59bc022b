// A progress bar on stderr, where that is a terminal.
#pragma once

#include <chrono>
#include <cstddef>
#include <string>

namespace bslam::cli {

class ProgressBar {
 public:
  ProgressBar(bool wanted, std::string unit);
  void show(std::size_t done, std::size_t all);  // redraws at most ten times a second
  void finish();                                 // ends the line

 private:
  using Clock = std::chrono::steady_clock;
  bool active_;
  std::string unit_;
  Clock::time_point start_ = Clock::now(), drawn_;
};

}  // namespace bslam::cli
