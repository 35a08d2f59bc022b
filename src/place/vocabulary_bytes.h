// Serialisation of vocabularies: the format of .bvoc files and of the embedded vocabulary.
//
//   offset  size  content (numbers are little endian)
//   0       8     "BSLAMVOC"
//   8       4     format version, 1
//   12      4     K: length of the descriptor kind, 1 to 64
//   16      4     branching
//   20      4     levels
//   24      4     N: number of nodes, including the root
//   28      4     W: number of words
//   32      K     descriptor kind, ASCII
//   32+K    N     number of children of each node, breadth-first
//   ...     32*(N-1)  descriptor of each node except the root: four 64-bit numbers
//   ...     4*W   weight of each word, IEEE 754
//   ...     8     Vocabulary::id(), which covers all of the above except magic and version
#pragma once

#include <string>
#include <string_view>

#include "base/result.h"
#include "place/vocabulary.h"

namespace bslam::place {

constexpr std::string_view kVocabularyBegin = "BSLAMVOC";

std::string serialise(const Vocabulary& vocabulary);

// Parses a vocabulary. Every length is checked against the number of bytes before memory is allocated for it. Errors
// (with empty file) name the field: magic, version, size, checksum, or any field rejected by Vocabulary::make.
Result<VocabularyPtr> deserialise(std::string_view bytes);

// Returns true if the bytes begin with kVocabularyBegin.
bool is_vocabulary(std::string_view bytes);

}  // namespace bslam::place
