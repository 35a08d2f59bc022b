// The number of processor cores.
#pragma once

#include <algorithm>
#include <thread>

namespace bslam {

// At least 1, also where the system does not tell.
inline int processor_cores() { return std::max(1, static_cast<int>(std::thread::hardware_concurrency())); }

}  // namespace bslam
