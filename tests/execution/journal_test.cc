#include "execution/journal.h"

#include <gtest/gtest.h>

namespace bslam::execution {
namespace {

constexpr std::string_view kText =
    "bslam-journal 1\n"
    "0 frame 0 7 -\n"
    "1 start 0 7 8\n"
    "2 frame 1 7 -\n"
    "3 map 0 8 9\n"
    "4 track 1 7 10\n"
    "5 loop 0 9 -\n"
    "6 global 0 8 11\n"
    "7 restart 1 11 12\n"
    "8 reduce 3 12 -\n"
    "9 final - 12 13\n";

TEST(Journal, IsReproducedFromItsText) {
  const auto journal = parse_journal(kText, "a.journal");
  ASSERT_TRUE(journal.ok()) << journal.error().message();
  EXPECT_EQ(journal->name, "a.journal");
  ASSERT_EQ(journal->entries.size(), 10u);
  EXPECT_EQ(journal->entries[3], (JournalEntry{JournalStep::kMap, 0, MapVersion(8), MapVersion(9)}));
  EXPECT_EQ(journal->entries[5], (JournalEntry{JournalStep::kLoop, 0, MapVersion(9), std::nullopt}));
  EXPECT_EQ(journal->entries[8], (JournalEntry{JournalStep::kReduce, 3, MapVersion(12), std::nullopt}));
  EXPECT_EQ(journal->entries[9].input, -1);
  EXPECT_EQ(journal_text(*journal), kText);
  EXPECT_TRUE(parse_journal("bslam-journal 1\n", "").ok());
}

TEST(Journal, ReportsTheLineOfAnInvalidEntry) {
  for (const std::string_view bad : {"1 start 0 7 8",          "0 jump 0 7 -",    "0 frame 0 7",
                                     "0 frame 0 7 - 1",        "0 frame  7 -",    "0 frame -1 7 -",
                                     "0 frame - 7 -",          "0 frame 0 - -",   "0 frame 99999999999 7 -",
                                     "0 frame 2147483647 7 -", "0 frame 0x1 7 -", "",
                                     "0 frame 0 7 8",          "0 reduce 4 7 -",  "0 reduce - 7 -",
                                     "0 reduce 1 7 8",         "0 track 0 7 -",   "0 track 0 7 9",
                                     "0 track 0 7 7",          "0 frame 0 7 -\r", "-0 frame 0 7 -"}) {
    const auto journal = parse_journal("bslam-journal 1\n" + std::string(bad) + "\n", "a.journal");
    ASSERT_FALSE(journal.ok()) << bad;
    EXPECT_EQ(journal.error().file, "a.journal");
    EXPECT_EQ(journal.error().key, "line 2");
  }
  EXPECT_EQ(parse_journal("bslam-journal 1\n0 frame 0 7 -\n1 map 0 8 9\n", "").error().key,
            "line 3");  // base not there yet
  EXPECT_EQ(parse_journal("bslam-journal 1\n0 frame 4 7 -\n1 frame 4 7 -\n", "").error().key, "line 3");  // twice
  for (const std::string_view header : {"", "bslam-journal 2\n", "bslam-journal 1 \n", "0 frame 0 7 -\n"}) {
    EXPECT_EQ(parse_journal(header, "").error().key, "line 1") << header;
  }
}

TEST(Journal, EveryTruncationIsRejectedOrValid) {
  for (std::size_t n = 0; n < kText.size(); ++n) {
    const std::string cut(kText.substr(0, n));
    const auto journal = parse_journal(cut, "");
    if (!journal) continue;
    EXPECT_EQ(journal_text(*journal).compare(0, cut.size(), cut), 0);
  }
}

}  // namespace
}  // namespace bslam::execution
