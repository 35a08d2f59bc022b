#include "base/atomic_file.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include "support/data_on_disk.h"

namespace bslam {
namespace {

namespace fs = std::filesystem;

int entries(const fs::path& folder) {
  int count = 0;
  for ([[maybe_unused]] const auto& entry : fs::directory_iterator(folder)) ++count;
  return count;
}

TEST(AtomicFile, WritesAndReadsAnyBytes) {
  const support::TemporaryFolder folder;
  std::string bytes = "text\n";
  bytes.push_back('\0');
  for (int i = 0; i < 300000; ++i) bytes.push_back(static_cast<char>(i * 31));
  ASSERT_TRUE(write_atomically(folder.path() / "file", bytes));
  EXPECT_EQ(read_file(folder.path() / "file", 1 << 20).value(), bytes);
  EXPECT_EQ(entries(folder.path()), 1);
}

TEST(AtomicFile, ReplacesAFile) {
  const support::TemporaryFolder folder;
  ASSERT_TRUE(write_atomically(folder.path() / "file", "a longer text"));
  ASSERT_TRUE(write_atomically(folder.path() / "file", "short"));
  EXPECT_EQ(read_file(folder.path() / "file", 100).value(), "short");
}

TEST(AtomicFile, RemovesTheTemporaryFileOnError) {
  const support::TemporaryFolder folder;
  fs::create_directories(folder.path() / "existing" / "inside");
  const Status onto_folder = write_atomically(folder.path() / "existing", "text");
  ASSERT_FALSE(onto_folder);
  EXPECT_EQ(onto_folder.error().file, (folder.path() / "existing").string());
  EXPECT_FALSE(write_atomically(folder.path() / "no" / "such" / "folder", "text"));
  EXPECT_EQ(entries(folder.path()), 1);
}

TEST(AtomicFile, NeverReplacesWhatIsNoRegularFile) {
  const support::TemporaryFolder folder;
  const fs::path pipe = folder.path() / "pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_EQ(write_atomically(pipe, "text").error().found, "something other than a regular file");
  EXPECT_FALSE(check_writable(pipe));
  EXPECT_TRUE(fs::is_fifo(pipe));
  EXPECT_EQ(entries(folder.path()), 1);
}

TEST(AtomicFile, WritesTheFileThatALinkLeadsTo) {
  const support::TemporaryFolder folder;
  fs::create_directories(folder.path() / "links");
  fs::create_directories(folder.path() / "files");
  const fs::path link = folder.path() / "links/first", file = folder.path() / "files/file";
  fs::create_symlink("second", link);
  fs::create_symlink("../files/file", folder.path() / "links/second");
  EXPECT_TRUE(check_writable(link));
  for (const char* text : {"created", "replaced"}) {
    ASSERT_TRUE(write_atomically(link, text));
    EXPECT_EQ(read_file(file, 100).value(), text);
    EXPECT_TRUE(fs::is_symlink(link));
    EXPECT_TRUE(fs::is_regular_file(fs::symlink_status(file)));
  }
  EXPECT_EQ(entries(folder.path() / "links"), 2);
  EXPECT_EQ(entries(folder.path() / "files"), 1);
}

TEST(AtomicFile, RejectsLinksThatLeadNowhere) {
  const support::TemporaryFolder folder;
  const fs::path loop = folder.path() / "loop", lost = folder.path() / "lost";
  fs::create_symlink("loop", loop);
  fs::create_symlink("none/file", lost);
  for (const fs::path& link : {loop, lost}) {
    EXPECT_FALSE(check_writable(link));
    EXPECT_EQ(write_atomically(link, "text").error().file, link.string());
    EXPECT_TRUE(fs::is_symlink(link));
  }
  EXPECT_EQ(entries(folder.path()), 2);
}

TEST(AtomicFile, CanBeCheckedBeforehand) {
  const support::TemporaryFolder folder;
  EXPECT_TRUE(check_writable(folder.path() / "new"));
  EXPECT_EQ(entries(folder.path()), 0);
  EXPECT_FALSE(check_writable(folder.path() / "none" / "new"));
  support::write_text(folder.path() / "old", "text");
  EXPECT_TRUE(check_writable(folder.path() / "old"));
  EXPECT_EQ(read_file(folder.path() / "old", 10).value(), "text");
}

TEST(AtomicFile, HasTheUsualPermissions) {
  const support::TemporaryFolder folder;
  const mode_t old = ::umask(022);
  ASSERT_TRUE(write_atomically(folder.path() / "file", "text"));
  ::umask(old);
  EXPECT_EQ(fs::status(folder.path() / "file").permissions() & fs::perms::mask, fs::perms(0644));
}

TEST(ReadFile, RejectsUnreadableFiles) {
  const support::TemporaryFolder folder;
  EXPECT_EQ(read_file(folder.path() / "none", 10).error().message(),
            "cannot open " + (folder.path() / "none").string() + ": No such file or directory");
  EXPECT_EQ(read_file(folder.path(), 10).error().found, "a folder");
  ASSERT_EQ(::mkfifo((folder.path() / "pipe").c_str(), 0600), 0);
  EXPECT_FALSE(read_file(folder.path() / "pipe", 10));
}

TEST(ReadFile, RejectsTooLargeFiles) {
  const support::TemporaryFolder folder;
  support::write_text(folder.path() / "file", "12345");
  EXPECT_TRUE(read_file(folder.path() / "file", 5));
  EXPECT_FALSE(read_file(folder.path() / "file", 4));
  support::write_text(folder.path() / "empty", "");
  EXPECT_EQ(read_file(folder.path() / "empty", 0).value(), "");
}

}  // namespace
}  // namespace bslam
