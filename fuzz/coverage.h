// Records which edges of the program an input reached, if the compiler supports it (-fsanitize-coverage=trace-pc of
// gcc).
#pragma once

#include <cstddef>

namespace bslam::fuzz {

// Starts a new recording.
void begin_coverage();

// Ends the recording and returns the number of edges that no previous input reached.
std::size_t new_places();

}  // namespace bslam::fuzz
