// The text format of DBoW2's vocabularies. Internal to io; see vocabulary_file.h.
#pragma once

#include <string_view>

#include "base/result.h"
#include "place/vocabulary.h"

namespace bslam::storage {

// True where the first line is four whole numbers.
bool is_dbow2_text(std::string_view text);

// Errors (file left empty) name the line.
Result<place::VocabularyPtr> parse_dbow2_text(std::string_view text);

}  // namespace bslam::storage
