// Reads and writes vocabularies in the format of bslam, and reads the text format of DBoW2.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "base/result.h"
#include "place/vocabulary.h"

namespace bslam::storage {

// The kind of descriptors of a DBoW2 vocabulary: 256 bits like those of bslam, but from another BRIEF pattern. Such a
// vocabulary assigns equal descriptors to equal words, but similar descriptors less often than a matching vocabulary.
constexpr std::string_view kDbow2Kind = "orb256-dbow2";

// Reads the binary format of bslam (place/vocabulary_bytes.h) or the text format of DBoW2: a line "k L scoring
// weighting", then a line "parent is_leaf 32_bytes weight" for each node except the root, numbered from 1 in the order
// of the lines. Errors name the file and the section or line: a file that cannot be read, has neither format, or is
// damaged. In the text format also: a descriptor of another length, a parent that follows its child or is a leaf, more
// children than k or levels than L, an inner node without children, values out of range.
Result<place::VocabularyPtr> read_vocabulary(const std::filesystem::path& file);

// Returns the vocabulary in `file`, or the vocabulary shipped with the program if `file` is empty.
Result<place::VocabularyPtr> vocabulary_or_shipped(const std::string& file);

// Writes the binary format of bslam. The file is written completely or not at all.
Status write_vocabulary(const place::Vocabulary& vocabulary, const std::filesystem::path& file);

}  // namespace bslam::storage
