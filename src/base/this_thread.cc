#include "base/this_thread.h"

#include <ctime>

#if defined(__linux__)
#include <sys/resource.h>
#endif

namespace bslam {

// On Linux the nice value applies to the calling thread only.
void lower_thread_priority() {
#if defined(__linux__)
  constexpr int kNice = 10;
  [[maybe_unused]] const int failed = setpriority(PRIO_PROCESS, 0, kNice);
#endif
}

double thread_ms() {
  timespec now{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

}  // namespace bslam
