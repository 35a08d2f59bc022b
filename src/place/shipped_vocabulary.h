// The vocabulary embedded in the program (data/vocabulary.bvoc), used if no other one is given.
#pragma once

#include <string_view>

#include "base/result.h"
#include "place/vocabulary.h"

namespace bslam::place {

// The bytes of the embedded file.
std::string_view shipped_vocabulary_bytes();

// Parses the embedded vocabulary at every call, which takes a few milliseconds; keep the result. An error means that
// the program was built with an invalid vocabulary file.
Result<VocabularyPtr> shipped_vocabulary();

}  // namespace bslam::place
