// A vocabulary as bytes: the content of a .bvoc file and of the program's own data.
//
//   offset  size  what (numbers are little endian)
//   0       8     "BSLAMVOC"
//   8       4     format version, 1
//   12      4     K: length of the descriptor kind, 1 to 64
//   16      4     branching
//   20      4     levels
//   24      4     N: nodes, the root among them
//   28      4     W: words
//   32      K     descriptor kind, ASCII
//   32+K    N     number of children of each node, breadth-first
//   ...     32*(N-1)  descriptor of each node but the root: four 64-bit numbers
//   ...     4*W   weight of each word, IEEE 754
//   ...     8     Vocabulary::id(), which covers all of the above but magic and version
#pragma once

#include <string>
#include <string_view>

#include "base/result.h"
#include "place/vocabulary.h"

namespace bslam::place {

std::string serialise(const Vocabulary& vocabulary);

// Every length is checked against the number of bytes before anything is allocated for it. Errors (file left empty)
// name the part: magic, version, size, what Vocabulary::make refuses, checksum.
Result<VocabularyPtr> deserialise(std::string_view bytes);

// True where the bytes begin as serialise() begins them.
bool is_vocabulary(std::string_view bytes);

}  // namespace bslam::place
