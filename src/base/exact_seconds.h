// Times as text, with every nanosecond.
#pragma once

#include <string>

#include "base/timestamp.h"

namespace bslam {

// Returns seconds with nine decimals, exact: 1.000000119.
std::string exact_seconds(TimeNs time_ns);

}  // namespace bslam
