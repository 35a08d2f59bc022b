// Assertions for what only we can cause. They stay on in release builds: a wrong map is worse than a stop.
#pragma once

namespace bslam {

[[noreturn]] void assertion_failed(const char* condition, const char* message, const char* file, int line);

}  // namespace bslam

#define BSLAM_ASSERT(condition, message) \
  ((condition) ? static_cast<void>(0) : ::bslam::assertion_failed(#condition, message, __FILE__, __LINE__))
