// Reads vocabularies in the text format of DBoW2. Internal to this folder; see vocabulary_file.h.
#pragma once

#include <string_view>

#include "base/result.h"
#include "place/vocabulary.h"

namespace bslam::storage {

// Returns true if the first line consists of four integers.
bool is_dbow2_text(std::string_view text);

// Errors name the line; Error.file is left empty.
Result<place::VocabularyPtr> parse_dbow2_text(std::string_view text);

}  // namespace bslam::storage
