// Which parts of the program an input reached, as far as the compiler tells (gcc's -fsanitize-coverage=trace-pc).
#pragma once

#include <cstddef>

namespace bslam::fuzz {

// Begins to record from nothing.
void begin_coverage();

// Ends recording and returns how many places were reached that no input before had reached.
std::size_t new_places();

}  // namespace bslam::fuzz
