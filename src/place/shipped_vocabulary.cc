#include "place/shipped_vocabulary.h"

#include "base/embedded_file.h"
#include "place/vocabulary_bytes.h"

namespace bslam::place {

BSLAM_EMBED_FILE(shipped_vocabulary_bytes, BSLAM_SHIPPED_VOCABULARY)

Result<VocabularyPtr> shipped_vocabulary() {
  auto vocabulary = deserialise(shipped_vocabulary_bytes());
  if (vocabulary) return vocabulary;
  Error error = vocabulary.error();
  error.file = "shipped vocabulary";
  return error;
}

}  // namespace bslam::place
