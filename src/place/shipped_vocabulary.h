// The vocabulary the program carries within itself (data/vocabulary.bvoc), so that none needs to be named.
#pragma once

#include <string_view>

#include "base/result.h"
#include "place/vocabulary.h"

namespace bslam::place {

// Its bytes, as in the file.
std::string_view shipped_vocabulary_bytes();

// Reads it anew at each call, in a few milliseconds: hold on to it. An error means a build with another file than the
// project's own.
Result<VocabularyPtr> shipped_vocabulary();

}  // namespace bslam::place
