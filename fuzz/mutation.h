// Mutation of inputs.
#pragma once

#include <span>
#include <string>

#include "base/random.h"

namespace bslam::fuzz {

// Applies one or several changes: of bytes and bits, of numbers in binary and in text, and of ranges, which are
// removed, duplicated, moved, or copied from another input of the corpus, which must not be empty.
std::string mutate(std::string input, std::span<const std::string> corpus, Random& random);

}  // namespace bslam::fuzz
