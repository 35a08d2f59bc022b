#include "storage/vocabulary_file.h"

#include <gtest/gtest.h>

#include "base/random.h"
#include "base/thread_pool.h"
#include "place/train.h"
#include "place/vocabulary_bytes.h"
#include "storage/dbow2_text.h"
#include "support/data_on_disk.h"

namespace bslam::storage {
namespace {

// Thirty-two bytes: `first`, then the same other value.
std::string bytes_text(int first, int rest = 0) {
  std::string text = std::to_string(first);
  for (int i = 1; i < 32; ++i) (text += ' ') += std::to_string(rest);
  return text;
}

// Two inner nodes with two words each, in the order DBoW2 writes them.
std::string good_text() {
  return std::string("2 2 0 0\n0 0 ") + bytes_text(0) + " 0\n" + "0 0 " + bytes_text(255, 255) + " 0\n" + "1 1 " +
         bytes_text(1) + " 1.5\n" + "1 1 " + bytes_text(2) + " 2.25 \r\n" + "2 1 " + bytes_text(254, 255) + " 0\n" +
         "2 1 " + bytes_text(253, 255) + " 3e-1\n\n";
}

class VocabularyFile : public testing::Test {
 protected:
  Result<place::VocabularyPtr> read(const std::string& text) {
    support::write_text(file_, text);
    return read_vocabulary(file_);
  }
  // `good_text` with the first `from` replaced.
  Result<place::VocabularyPtr> read_changed(const std::string& from, const std::string& to) {
    std::string text = good_text();
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return read(text.replace(at, from.size(), to));
  }

  support::TemporaryFolder folder_;
  std::filesystem::path file_ = folder_.path() / "words.bvoc";
};

TEST_F(VocabularyFile, RoundTrips) {
  Random random(1);
  std::vector<std::vector<feature::Descriptor>> images(5);
  for (auto& image : images) {
    for (int i = 0; i < 100; ++i) image.push_back({random.next(), random.next(), random.next(), random.next()});
  }
  ThreadPool pool(1);
  const auto made = place::train_vocabulary(images, {.branching = 4, .levels = 3}, random, pool).value();
  ASSERT_TRUE(write_vocabulary(*made, file_));
  const auto read = read_vocabulary(file_);
  ASSERT_TRUE(read.ok()) << read.error().message();
  EXPECT_EQ(place::serialise(**read), place::serialise(*made));
  EXPECT_FALSE(write_vocabulary(*made, folder_.path() / "none" / "words.bvoc"));
}

TEST_F(VocabularyFile, ErrorsNameTheFile) {
  EXPECT_EQ(read_vocabulary(folder_.path() / "none").error().file, (folder_.path() / "none").string());
  for (const char* text : {"", "\n", "some text\n", "1 2 3\n", "1 2 3 4 5\n", "BSLAMVOC", "a b c d\n"}) {
    const auto none = read(text);
    ASSERT_FALSE(none.ok()) << text;
    EXPECT_EQ(none.error().file, file_.string());
  }
}

TEST_F(VocabularyFile, ReadsDbow2Text) {
  const auto vocabulary = read(good_text());
  ASSERT_TRUE(vocabulary.ok()) << vocabulary.error().message();
  const place::Vocabulary& v = **vocabulary;
  EXPECT_EQ(v.kind(), kDbow2Kind);
  EXPECT_NE(v.kind(), place::kDescriptorKind);
  EXPECT_EQ(v.branching(), 2);
  EXPECT_EQ(v.levels(), 2);
  EXPECT_EQ(v.content().weight, (std::vector<float>{1.5f, 2.25f, 0.0f, 0.3f}));
  EXPECT_EQ(v.word(feature::Descriptor{2, 0, 0, 0}), WordId(1));
  EXPECT_EQ(v.word(feature::Descriptor{0, 0, 0, 0}), WordId(0));  // at the same distance from word 1
  EXPECT_EQ(v.word(feature::Descriptor{~2ull, ~0ull, ~0ull, ~0ull}), WordId(3));
}

// DBoW2 numbers nodes in order of creation, which is not breadth-first: children of the second node may come first.
TEST_F(VocabularyFile, ReadsNodesInAnyOrderOfParentsBeforeChildren) {
  const auto vocabulary = read(std::string("2 2 0 0\n0 0 ") + bytes_text(0) + " 0\n0 0 " + bytes_text(255, 255) +
                               " 0\n2 1 " + bytes_text(254, 255) + " 7\n1 1 " + bytes_text(1) + " 5\n2 1 " +
                               bytes_text(253, 255) + " 8\n1 1 " + bytes_text(2) + " 6\n");
  ASSERT_TRUE(vocabulary.ok()) << vocabulary.error().message();
  EXPECT_EQ((*vocabulary)->content().weight, (std::vector<float>{5, 6, 7, 8}));
  EXPECT_EQ((*vocabulary)->content().descriptor[2][0], 1u);
}

TEST_F(VocabularyFile, RejectsTextThatIsNotATree) {
  const auto line_of = [](const Result<place::VocabularyPtr>& r) { return r.ok() ? "accepted" : r.error().key; };
  EXPECT_EQ(line_of(read_changed("2 2 0 0", "1 2 0 0")), "line 1");
  EXPECT_EQ(line_of(read_changed("2 2 0 0", "100000 2 0 0")), "line 1");
  EXPECT_EQ(line_of(read_changed("2 2 0 0", "2 99999999999 0 0")), "line 1");
  EXPECT_EQ(line_of(read_changed("2 2 0 0", "2 2 6 0")), "line 1");
  EXPECT_EQ(line_of(read_changed("2 2 0 0", "2 1 0 0")), "line 4");  // deeper than the given number of levels
  EXPECT_EQ(line_of(read_changed("\n1 1 ", "\n0 1 ")), "line 4");    // a third child of the root
  EXPECT_EQ(line_of(read_changed("\n1 1 ", "\n3 1 ")), "line 4");    // its own parent
  EXPECT_EQ(line_of(read_changed("\n1 1 ", "\n5 1 ")), "line 4");    // a parent that comes later: a cycle
  EXPECT_EQ(line_of(read_changed("\n1 1 ", "\n-1 1 ")), "line 4");
  EXPECT_EQ(line_of(read_changed("\n1 1 ", "\n4294967297 1 ")), "line 4");
  EXPECT_EQ(line_of(read_changed("\n2 1 ", "\n3 1 ")), "line 6");  // below a leaf
  EXPECT_EQ(line_of(read_changed("\n1 1 ", "\n1 2 ")), "line 4");
  EXPECT_EQ(line_of(read_changed("\n1 1 ", "\n1 0 ")), "line 4");  // an inner node without children
  EXPECT_EQ(line_of(read_changed(" 1.5", " -1.5")), "line 4");
  EXPECT_EQ(line_of(read_changed(" 1.5", " nan")), "line 4");
  EXPECT_EQ(line_of(read_changed(" 1.5", " inf")), "line 4");
  EXPECT_EQ(line_of(read_changed(" 1.5", " 1e300")), "line 4");
  EXPECT_EQ(line_of(read_changed(" 1.5", " 1.5x")), "line 4");
  EXPECT_EQ(line_of(read_changed(" 1.5", "")), "line 4");
  EXPECT_EQ(line_of(read_changed("\n1 1 1 ", "\n1 1 256 ")), "line 4");
  EXPECT_EQ(line_of(read_changed("\n1 1 1 ", "\n1 1 1 1 ")), "line 4");  // a descriptor of 33 bytes
  EXPECT_FALSE(read("2 2 0 0\n").ok());
}

TEST_F(VocabularyFile, RejectsOtherDescriptorLengths) {
  std::string line = "0 1";
  for (int i = 0; i < 64; ++i) line += " 7";
  const auto longer = read(std::string("10 6 0 0\n") + line + " 1.0\n");
  ASSERT_FALSE(longer.ok());
  EXPECT_EQ(longer.error().key, "line 2");
  EXPECT_NE(longer.error().expected.find("32 bytes"), std::string::npos);
}

TEST(Dbow2Text, HandlesDamage) {
  Random random(5);
  const std::string good = good_text();
  int accepted = 0;
  for (int round = 0; round < 3000; ++round) {
    std::string damaged = good;
    for (std::uint32_t n = 0; n <= random.below(4); ++n) {
      damaged[random.below(static_cast<std::uint32_t>(damaged.size()))] = "0123456789 -.\ne"[random.below(15)];
    }
    if (round % 3 == 0) damaged.resize(random.below(static_cast<std::uint32_t>(damaged.size())));
    const auto result = parse_dbow2_text(damaged);
    if (!result.ok()) {
      EXPECT_FALSE(result.error().key.empty());
      continue;
    }
    ++accepted;
    EXPECT_LT((*result)->word(feature::Descriptor{random.next(), 0, 1, 2}).index(), (*result)->size());
  }
  EXPECT_GT(accepted, 100);
  EXPECT_LT(accepted, 2900);
}

}  // namespace
}  // namespace bslam::storage
