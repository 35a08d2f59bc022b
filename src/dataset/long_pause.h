// When the frames of a recording are so far apart that they may be those of two.
#pragma once

#include "base/timestamp.h"

namespace bslam::dataset {

// A longer time without any image may be a clock that was set, or the time between two recordings in one.
constexpr TimeNs kLongPause = 60'000'000'000;  // nanoseconds

}  // namespace bslam::dataset
