// Inputs made from others.
#pragma once

#include <span>
#include <string>

#include "base/random.h"

namespace bslam::fuzz {

// One to several changes: bytes and bits, numbers in binary and in text, ranges cut, doubled, moved, or taken from
// another input of the corpus (not empty).
std::string mutate(std::string input, std::span<const std::string> corpus, Random& random);

}  // namespace bslam::fuzz
