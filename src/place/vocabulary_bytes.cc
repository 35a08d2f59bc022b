#include "place/vocabulary_bytes.h"

#include <bit>
#include <concepts>
#include <cstring>
#include <utility>

namespace bslam::place {
namespace {

constexpr std::uint32_t kVersion = 1;
constexpr std::size_t kHeaderBytes = 32;

template <std::unsigned_integral T>
void append(std::string& bytes, T value) {
  for (std::size_t i = 0; i < sizeof(T); ++i) bytes.push_back(static_cast<char>(value >> (8 * i)));
}

template <std::unsigned_integral T>
T number_at(const char* bytes) {
  T value = 0;
  for (std::size_t i = 0; i < sizeof(T); ++i)
    value |= static_cast<T>(static_cast<T>(static_cast<unsigned char>(bytes[i])) << (8 * i));
  return value;
}

// Sizes of the sections after the header. Their sum cannot overflow 64 bits.
struct Lengths {
  std::uint64_t kind, nodes, words;
  std::uint64_t total() const { return kHeaderBytes + kind + nodes + 32 * (nodes - 1) + 4 * words + 8; }
};

}  // namespace

std::string serialise(const Vocabulary& vocabulary) {
  const VocabularyContent& c = vocabulary.content();
  std::string bytes(kVocabularyBegin);
  bytes.reserve(Lengths{c.kind.size(), c.child_count.size(), c.weight.size()}.total());
  for (const std::size_t n : {std::size_t{kVersion}, c.kind.size(), static_cast<std::size_t>(c.branching),
                              static_cast<std::size_t>(c.levels), c.child_count.size(), c.weight.size()}) {
    append(bytes, static_cast<std::uint32_t>(n));
  }
  bytes += c.kind;
  for (const std::uint8_t count : c.child_count) append(bytes, count);
  for (const feature::Descriptor& d : c.descriptor) {
    for (const std::uint64_t bits : d) append(bytes, bits);
  }
  for (const float w : c.weight) append(bytes, std::bit_cast<std::uint32_t>(w));
  append(bytes, vocabulary.id());
  return bytes;
}

bool is_vocabulary(std::string_view bytes) { return bytes.starts_with(kVocabularyBegin); }

Result<VocabularyPtr> deserialise(std::string_view bytes) {
  if (!is_vocabulary(bytes))
    return Error{"", "", "not a bslam vocabulary", "bytes that begin with " + std::string(kVocabularyBegin)};
  if (bytes.size() < kHeaderBytes)
    return Error{"", "size", std::to_string(bytes.size()) + " bytes", "a complete header"};
  const auto field = [&](std::size_t offset) { return number_at<std::uint32_t>(bytes.data() + offset); };
  if (field(8) != kVersion) return Error{"", "version", std::to_string(field(8)), std::to_string(kVersion)};
  const Lengths lengths{field(12), field(24), field(28)};
  if (lengths.nodes < 2 || lengths.nodes > kMaxNodes) {
    return Error{"", "nodes", std::to_string(lengths.nodes), "2 to " + std::to_string(kMaxNodes)};
  }
  if (lengths.total() != bytes.size()) {
    return Error{"", "size", std::to_string(bytes.size()) + " bytes", std::to_string(lengths.total())};
  }
  if (field(16) > kMaxBranching)
    return Error{"", "branching", std::to_string(field(16)), "at most " + std::to_string(kMaxBranching)};
  if (field(20) > kMaxLevels)
    return Error{"", "levels", std::to_string(field(20)), "at most " + std::to_string(kMaxLevels)};

  const char* at = bytes.data() + kHeaderBytes;
  VocabularyContent c;
  c.kind.assign(at, lengths.kind);
  at += lengths.kind;
  c.branching = static_cast<int>(field(16));
  c.levels = static_cast<int>(field(20));
  c.child_count.resize(lengths.nodes);
  std::memcpy(c.child_count.data(), at, lengths.nodes);
  at += lengths.nodes;
  c.descriptor.resize(lengths.nodes - 1);
  for (feature::Descriptor& d : c.descriptor) {
    for (std::uint64_t& bits : d) bits = number_at<std::uint64_t>(std::exchange(at, at + 8));
  }
  c.weight.resize(lengths.words);
  for (float& w : c.weight) w = std::bit_cast<float>(number_at<std::uint32_t>(std::exchange(at, at + 4)));

  const std::uint64_t checksum = number_at<std::uint64_t>(at);
  auto vocabulary = Vocabulary::make(std::move(c));
  if (vocabulary && (*vocabulary)->id() != checksum)
    return Error{"", "checksum", "mismatch", "the checksum of the content (the bytes are damaged)"};
  return vocabulary;
}

}  // namespace bslam::place
