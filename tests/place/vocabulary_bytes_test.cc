#include "place/vocabulary_bytes.h"

#include <gtest/gtest.h>

#include <cstring>

#include "place/random_descriptors.h"

namespace bslam::place {
namespace {

class VocabularyBytes : public testing::Test {
 protected:
  // Overwrites the bytes at `offset` with a number.
  template <class T>
  static void put(std::string& bytes, std::size_t offset, T value) {
    std::memcpy(bytes.data() + offset, &value, sizeof(T));
  }

  // Replaces the checksum of damaged bytes by the correct one, if their content forms a vocabulary at all. It is taken
  // from a vocabulary made of the same numbers. A damaged structure must be rejected before the checksum.
  static void repair_checksum(std::string& bytes) {
    if (bytes.size() < 40) return;
    std::uint32_t field[6];
    std::memcpy(field, bytes.data() + 8, sizeof field);
    const auto [version, kind, branching, levels, nodes, words] = std::to_array(field);
    const std::uint64_t total = 32ull + kind + nodes + 32ull * nodes - 32 + 4ull * words + 8;
    if (nodes < 2 || total != bytes.size()) return;
    VocabularyContent c;
    const char* at = bytes.data() + 32;
    c.kind.assign(at, kind);
    c.branching = static_cast<int>(branching);
    c.levels = static_cast<int>(levels);
    c.child_count.resize(nodes);
    c.descriptor.resize(nodes - 1);
    c.weight.resize(words);
    std::memcpy(c.child_count.data(), at + kind, nodes);
    std::memcpy(c.descriptor.data(), at + kind + nodes, 32ull * (nodes - 1));
    if (words > 0) std::memcpy(c.weight.data(), bytes.data() + bytes.size() - 8 - 4ull * words, 4ull * words);
    if (const auto v = Vocabulary::make(c)) put(bytes, bytes.size() - 8, (*v)->id());
  }

  Random random_{31};
  VocabularyPtr vocabulary_ = random_vocabulary(5, 3, random_);
  std::string bytes_ = serialise(*vocabulary_);
};

TEST_F(VocabularyBytes, RoundTrip) {
  const auto read = deserialise(bytes_);
  ASSERT_TRUE(read.ok()) << read.error().message();
  const VocabularyContent &a = vocabulary_->content(), &b = (*read)->content();
  EXPECT_EQ(a.kind, b.kind);
  EXPECT_EQ(a.branching, b.branching);
  EXPECT_EQ(a.levels, b.levels);
  EXPECT_EQ(a.child_count, b.child_count);
  EXPECT_EQ(a.descriptor, b.descriptor);
  EXPECT_EQ(a.weight, b.weight);
  EXPECT_EQ((*read)->id(), vocabulary_->id());
  EXPECT_EQ(serialise(**read), bytes_);
  EXPECT_TRUE(is_vocabulary(bytes_));
}

TEST_F(VocabularyBytes, AreRejectedWhenDamaged) {
  for (int round = 0; round < 2000; ++round) {
    std::string damaged = bytes_;
    switch (round % 4) {
      case 0:  // flip a bit
        damaged[random_.below(static_cast<std::uint32_t>(damaged.size()))] ^= static_cast<char>(1 << random_.below(8));
        break;
      case 1:  // truncate
        damaged.resize(random_.below(static_cast<std::uint32_t>(damaged.size())));
        break;
      case 2:  // change a length or size in the header
        put(damaged, 8 + 4 * random_.below(6), static_cast<std::uint32_t>(random_.next() >> random_.below(64)));
        break;
      case 3:  // append bytes
        damaged.append(1 + random_.below(100), static_cast<char>(random_.below(256)));
        break;
    }
    if (damaged == bytes_) continue;
    const auto read = deserialise(damaged);
    ASSERT_FALSE(read.ok()) << "round " << round;
    ASSERT_FALSE(read.error().message().empty());
  }
}

// With a repaired checksum, damaged bytes give either an error or a vocabulary of those numbers, whose words are in
// range.
TEST_F(VocabularyBytes, AreSafeWhenDamagedWithAMatchingChecksum) {
  int accepted = 0, rejected = 0;
  for (int round = 0; round < 2000; ++round) {
    std::string damaged = bytes_;
    const std::size_t header_and_counts = 32 + vocabulary_->kind().size() + vocabulary_->num_nodes();
    const std::size_t reach = round % 2 == 0 ? header_and_counts : damaged.size() - 8;
    for (std::uint32_t n = 0; n <= random_.below(3); ++n) {
      damaged[random_.below(static_cast<std::uint32_t>(reach))] =
          static_cast<char>(random_.below(round % 3 == 0 ? 256 : 6));
    }
    repair_checksum(damaged);
    const auto read = deserialise(damaged);
    read.ok() ? ++accepted : ++rejected;
    if (!read) continue;
    for (int i = 0; i < 20; ++i) ASSERT_LT((*read)->word(random_descriptor(random_)).index(), (*read)->size());
  }
  EXPECT_GT(accepted, 200);  // the repair works
  EXPECT_GT(rejected, 200);
}

TEST_F(VocabularyBytes, ErrorsNameTheField) {
  EXPECT_EQ(deserialise("").error().found, "not a bslam vocabulary");
  EXPECT_EQ(deserialise("BSLAMVOC").error().key, "size");
  std::string newer = bytes_;
  put(newer, 8, std::uint32_t{2});
  EXPECT_EQ(deserialise(newer).error().key, "version");
  std::string huge = bytes_;
  put(huge, 24, ~std::uint32_t{0});
  EXPECT_EQ(deserialise(huge).error().key, "nodes");
  std::string flipped = bytes_;
  flipped[flipped.size() / 2] ^= 1;
  EXPECT_EQ(deserialise(flipped).error().key, "checksum");
}

}  // namespace
}  // namespace bslam::place
