// Assertions check conditions that only a bug in bslam can violate. They stay enabled in release builds, because a
// corrupt map is worse than a crash.
#pragma once

namespace bslam {

[[noreturn]] void assertion_failed(const char* condition, const char* message, const char* file, int line);

}  // namespace bslam

#define BSLAM_ASSERT(condition, message) \
  ((condition) ? static_cast<void>(0) : ::bslam::assertion_failed(#condition, message, __FILE__, __LINE__))
