#include "base/atomic_folder.h"

#include <gtest/gtest.h>

#include "support/data_on_disk.h"

namespace bslam {
namespace {

namespace fs = std::filesystem;

std::size_t entries_of(const fs::path& folder) {
  return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder), fs::directory_iterator()));
}

TEST(AtomicFolder, AppearsWithAllFilesAtCommit) {
  const support::TemporaryFolder folder;
  const fs::path place = folder.path() / "deep/place";
  auto written = AtomicFolder::create(place / "", false);
  ASSERT_TRUE(written) << written.error().message();
  ASSERT_TRUE(written->write("a.txt", "first"));
  ASSERT_TRUE(written->write("sub/b.txt", "second"));
  EXPECT_FALSE(fs::exists(place));
  ASSERT_TRUE(written->commit());
  EXPECT_EQ(support::read_text(place / "a.txt"), "first");
  EXPECT_EQ(support::read_text(place / "sub/b.txt"), "second");
  EXPECT_EQ(entries_of(place.parent_path()), 1u);
}

TEST(AtomicFolder, LeavesNothingWithoutCommit) {
  const support::TemporaryFolder folder;
  {
    auto written = AtomicFolder::create(folder.path() / "place", false);
    ASSERT_TRUE(written);
    ASSERT_TRUE(written->write("a.txt", "first"));
  }
  EXPECT_EQ(entries_of(folder.path()), 0u);
}

TEST(AtomicFolder, WritesTheFolderThatALinkLeadsTo) {
  const support::TemporaryFolder folder;
  const fs::path place = folder.path() / "place", link = folder.path() / "link", lost = folder.path() / "lost";
  fs::create_directories(place);
  fs::create_directory_symlink("place", link);
  fs::create_directory_symlink("none", lost);
  for (const char* text : {"first", "second"}) {  // into an empty folder, and into one with files
    auto written = AtomicFolder::create(link, true);
    ASSERT_TRUE(written);
    ASSERT_TRUE(written->write("a.txt", text));
    const Status committed = written->commit();
    ASSERT_TRUE(committed) << committed.error().message();
    EXPECT_EQ(support::read_text(place / "a.txt"), text);
    EXPECT_TRUE(fs::is_symlink(link));
  }
  EXPECT_FALSE(AtomicFolder::create(lost, true));
  EXPECT_EQ(entries_of(folder.path()), 3u);
}

TEST(AtomicFolder, KeepsOtherFilesOfAnExistingFolder) {
  const support::TemporaryFolder folder;
  const fs::path place = folder.path() / "place";
  support::write_text(place / "mine.txt", "mine");
  support::write_text(place / "sub/old.txt", "old");
  EXPECT_FALSE(AtomicFolder::create(place, false));
  {
    auto written = AtomicFolder::create(place, true);
    ASSERT_TRUE(written);
    ASSERT_TRUE(written->write("sub/old.txt", "new"));
    ASSERT_TRUE(written->commit());
  }
  EXPECT_EQ(support::read_text(place / "mine.txt"), "mine");
  EXPECT_EQ(support::read_text(place / "sub/old.txt"), "new");
  EXPECT_EQ(entries_of(folder.path()), 1u);
}

// "b" cannot be replaced, since it is a folder. "a" and "new" come before and after it.
TEST(AtomicFolder, AFailedCommitLeavesAnExistingFolderAsItWas) {
  const support::TemporaryFolder folder;
  const fs::path place = folder.path() / "place";
  support::write_text(place / "a/old.txt", "old");
  support::write_text(place / "b/mine.txt", "mine");
  {
    auto written = AtomicFolder::create(place, true);
    ASSERT_TRUE(written);
    for (const char* name : {"a/old.txt", "a/sub/added.txt", "b", "new.txt"}) ASSERT_TRUE(written->write(name, "new"));
    const Status committed = written->commit();
    ASSERT_FALSE(committed);
    EXPECT_EQ(committed.error().message().find("the files that were replaced"), std::string::npos);
  }
  EXPECT_EQ(support::read_text(place / "a/old.txt"), "old");
  EXPECT_EQ(support::read_text(place / "b/mine.txt"), "mine");
  EXPECT_EQ(entries_of(place / "a"), 1u);
  EXPECT_EQ(entries_of(place), 2u);
  EXPECT_EQ(entries_of(folder.path()), 1u);
}

TEST(AtomicFolder, RejectsNamesThatLeadOutOfIt) {
  const support::TemporaryFolder folder;
  const fs::path outside = folder.path() / "outside.txt";
  auto written = AtomicFolder::create(folder.path() / "place", false);
  ASSERT_TRUE(written);
  for (const fs::path& name : {fs::path("../outside.txt"), fs::path("sub/../../outside.txt"), outside, fs::path(""),
                               fs::path("."), fs::path(".."), fs::path("sub/..")})
    EXPECT_FALSE(written->write(name, "text")) << name;
  EXPECT_FALSE(fs::exists(outside));
  ASSERT_TRUE(written->write("sub/../inside.txt", "text"));
  ASSERT_TRUE(written->commit());
  EXPECT_EQ(support::read_text(folder.path() / "place/inside.txt"), "text");
  EXPECT_EQ(entries_of(folder.path()), 1u);
}

TEST(AtomicFolder, RejectsAFile) {
  const support::TemporaryFolder folder;
  support::write_text(folder.path() / "file", "");
  EXPECT_FALSE(AtomicFolder::create(folder.path() / "file", true));
  EXPECT_FALSE(AtomicFolder::create(folder.path() / "file/below", true));
  EXPECT_EQ(entries_of(folder.path()), 1u);
}

}  // namespace
}  // namespace bslam
