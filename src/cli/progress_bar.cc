#include "cli/progress_bar.h"

#include <unistd.h>

#include <cstdio>
#include <utility>

#include "cli/print_message.h"

namespace bslam::cli {

ProgressBar::ProgressBar(bool enabled, std::string unit)
    : active_(enabled && isatty(STDERR_FILENO) == 1), unit_(std::move(unit)) {}

void ProgressBar::show(std::size_t done, std::size_t all) {
  const auto now = Clock::now();
  if (!active_ || ((done < all || all == 0) && now - drawn_ < std::chrono::milliseconds(100))) return;
  drawn_ = now;
  const double elapsed = std::chrono::duration<double>(now - start_).count();
  if (all == 0) {
    print_message("\r{} {} in {:.0f} s ", done, unit_, elapsed);
    std::fflush(stderr);
    return;
  }
  constexpr std::size_t kWidth = 40;
  const std::size_t filled = kWidth * done / all;
  const double left = done > 0 ? elapsed * static_cast<double>(all - done) / static_cast<double>(done) : 0.0;
  print_message("\r[{}{}] {}/{} {}, {:.0f} s left ", std::string(filled, '#'), std::string(kWidth - filled, '.'), done,
                all, unit_, left);
  std::fflush(stderr);
}

void ProgressBar::finish() {
  if (active_ && drawn_ != Clock::time_point()) std::fputc('\n', stderr);
  active_ = false;
}

}  // namespace bslam::cli
