#include "place/shipped_vocabulary.h"

#include "place/vocabulary_bytes.h"

// The assembler includes the file; a compiler would need minutes for an array of millions of numbers.
asm(".pushsection .rodata\n"
    ".balign 32\n"
    ".hidden bslam_shipped_vocabulary_begin\n"
    ".hidden bslam_shipped_vocabulary_end\n"
    ".global bslam_shipped_vocabulary_begin\n"
    ".global bslam_shipped_vocabulary_end\n"
    "bslam_shipped_vocabulary_begin:\n"
    ".incbin \"" BSLAM_SHIPPED_VOCABULARY
    "\"\n"
    "bslam_shipped_vocabulary_end:\n"
    ".byte 0\n"
    ".popsection\n");

extern "C" {
extern const char bslam_shipped_vocabulary_begin[];
extern const char bslam_shipped_vocabulary_end[];
}

namespace bslam::place {

std::string_view shipped_vocabulary_bytes() { return {bslam_shipped_vocabulary_begin, bslam_shipped_vocabulary_end}; }

Result<VocabularyPtr> shipped_vocabulary() {
  auto vocabulary = deserialise(shipped_vocabulary_bytes());
  if (vocabulary) return vocabulary;
  Error error = vocabulary.error();
  error.file = "shipped vocabulary";
  return error;
}

}  // namespace bslam::place
