#include "storage/vocabulary_file.h"

#include <utility>

#include "base/atomic_file.h"
#include "place/shipped_vocabulary.h"
#include "place/vocabulary_bytes.h"
#include "storage/dbow2_text.h"

namespace bslam::storage {
namespace {

constexpr std::size_t kMaxBytes = std::size_t{1} << 30;

Result<place::VocabularyPtr> parse(std::string_view bytes) {
  if (place::is_vocabulary(bytes)) return place::deserialise(bytes);
  if (is_dbow2_text(bytes)) return parse_dbow2_text(bytes);
  return Error{"", "", "a file of another format", "a file written by bslam vocab train, or the text format of DBoW2"};
}

}  // namespace

Result<place::VocabularyPtr> read_vocabulary(const std::filesystem::path& file) {
  const auto bytes = read_file(file, kMaxBytes);
  if (!bytes) return bytes.error();
  auto vocabulary = parse(*bytes);
  if (vocabulary) return vocabulary;
  Error error = vocabulary.error();
  error.file = file.string();
  return error;
}

Result<place::VocabularyPtr> vocabulary_or_shipped(const std::string& file) {
  return file.empty() ? place::shipped_vocabulary() : read_vocabulary(file);
}

Status write_vocabulary(const place::Vocabulary& vocabulary, const std::filesystem::path& file) {
  return write_atomically(file, place::serialise(vocabulary));
}

}  // namespace bslam::storage
