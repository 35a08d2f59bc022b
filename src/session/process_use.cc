#include "session/process_use.h"

#include <sys/resource.h>

#include <fstream>
#include <string>

namespace bslam::session {
namespace {

std::optional<double> status_mb(const std::string& key) {
  constexpr double kPerMb = 1024.0;  // the file is in kB
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with(key + ":")) return std::stod(line.substr(key.size() + 1)) / kPerMb;
  }
  return std::nullopt;
}

double seconds(const timeval& time) {
  return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
}

}  // namespace

std::optional<double> cpu_seconds() {
  rusage use{};
  if (::getrusage(RUSAGE_SELF, &use) != 0) return std::nullopt;
  return seconds(use.ru_utime) + seconds(use.ru_stime);
}

std::optional<double> resident_memory_mb() { return status_mb("VmRSS"); }

std::optional<double> peak_memory_mb() { return status_mb("VmHWM"); }

}  // namespace bslam::session
