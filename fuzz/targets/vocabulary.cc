// Vocabularies in the format of bslam and in the text format of DBoW2.
#include "base/random.h"
#include "place/vocabulary_bytes.h"
#include "storage/vocabulary_file.h"
#include "target.h"

namespace bslam::fuzz {

std::vector<std::string> seeds() {
  Random random(3, "fuzz vocabulary");
  place::VocabularyContent content;
  content.branching = 3;
  content.levels = 2;
  content.child_count = {3, 2, 0, 3, 0, 0, 0, 0, 0};
  for (int i = 0; i < 8; ++i)
    content.descriptor.push_back({random.next(), random.next(), random.next(), random.next()});
  content.weight = {1, 0.5f, 2, 1, 1, 3};
  const auto vocabulary = place::Vocabulary::make(content);
  require(vocabulary.ok(), "the seed must be a vocabulary");
  std::string bytes32;
  for (int i = 0; i < 32; ++i) bytes32 += std::to_string(7 * i % 256) + " ";
  const std::string text =
      "3 2 0 0\n0 0 " + bytes32 + "0.5\n1 1 " + bytes32 + "1.5\n1 1 " + bytes32 + "0.25\n0 1 " + bytes32 + "2\n";
  return {place::serialise(**vocabulary), text};
}

}  // namespace bslam::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace bslam;
  const auto vocabulary = storage::read_vocabulary(fuzz::scratch_file("vocabulary", fuzz::as_text(data, size)));
  if (!vocabulary) return 0;
  const place::Vocabulary& v = **vocabulary;
  for (const feature::Descriptor& d : {feature::Descriptor{}, feature::Descriptor{~0ull, 1, 2, 3}}) {
    const WordId word = v.word(d);
    fuzz::require(word.valid() && word.index() < v.size(), "the word must be in the vocabulary");
    fuzz::require(v.weight(word) >= 0, "the weight must not be negative");
  }
  const auto again = place::deserialise(place::serialise(v));
  fuzz::require(again.ok() && (*again)->id() == v.id(), "a written vocabulary must be read back equal");
  return 0;
}
