// Resource usage of this process according to the operating system.
#pragma once

#include <optional>

namespace bslam::session {

// Processor time of all threads so far, in seconds; nullopt if unavailable.
std::optional<double> cpu_seconds();

// The resident memory at present and at most so far, in MB (2^20 bytes), as reported by Linux; nullopt if unavailable.
std::optional<double> resident_memory_mb();
std::optional<double> peak_memory_mb();

}  // namespace bslam::session
