// Vocabularies as files: ours, and the text format of DBoW2.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "base/result.h"
#include "place/vocabulary.h"

namespace bslam::storage {

// Kind of the descriptors of a DBoW2 vocabulary: 256 bits as ours, of other binary tests. Its tree still sends equal
// descriptors of ours to equal words, but less alike ones stay together in it less often.
constexpr std::string_view kDbow2Kind = "orb256-dbow2";

// Reads our binary format (place/vocabulary_bytes.h), or DBoW2's text: a line "k L scoring weighting", then a line
// "parent is_leaf 32_bytes weight" for each node but the root, numbered from 1 in the order of the lines. Errors name
// the file and the part or line: not readable, neither format, damaged; of the text also a descriptor of another
// length, a parent that does not stand before its child or is a leaf, more children than k or levels than L, an inner
// node without children, values out of range.
Result<place::VocabularyPtr> read_vocabulary(const std::filesystem::path& file);

// The one of the file, or where none is named the one the program carries.
Result<place::VocabularyPtr> vocabulary_or_shipped(const std::string& file);

// Writes our binary format; the file appears whole or not at all.
Status write_vocabulary(const place::Vocabulary& vocabulary, const std::filesystem::path& file);

}  // namespace bslam::storage
