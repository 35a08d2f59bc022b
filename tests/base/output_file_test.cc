#include "base/output_file.h"

#include <gtest/gtest.h>

#include "support/data_on_disk.h"

namespace bslam {
namespace {

namespace fs = std::filesystem;

TEST(OutputFile, ReplacesAFileOfItsKindIfItMay) {
  const support::TemporaryFolder folder;
  const std::string map = folder.path() / "a.map", notes = folder.path() / "notes", empty = folder.path() / "empty";
  support::write_text(map, "MAP 1");
  support::write_text(notes, "mine");
  support::write_text(empty, "");
  EXPECT_TRUE(check_output_file("", "--out", false, "MAP"));
  EXPECT_TRUE(check_output_file(folder.path() / "new", "--out", false, "MAP"));
  for (const std::string& file : {map, empty}) {
    EXPECT_TRUE(check_output_file(file, "--out", true, "MAP")) << file;
    EXPECT_EQ(check_output_file(file, "--out", false, "MAP").error().found, "an existing file") << file;
  }
  EXPECT_EQ(check_output_file(notes, "--out", true, "MAP").error().found, "an existing file of another kind");
  EXPECT_EQ(check_output_file(folder.path(), "--out", true, "MAP").error().found, "a folder");
  EXPECT_EQ(check_output_file(folder.path() / "none/a", "--out", true, "MAP").error().found, "no such folder");
}

TEST(OutputFile, IsNoInputUnderAnyName) {
  const support::TemporaryFolder folder;
  const fs::path input = folder.path() / "input", link = folder.path() / "link", other = folder.path() / "other";
  support::write_text(input, "precious");
  support::write_text(other, "");
  fs::create_symlink(input, link);
  for (const fs::path& file : {input, link, folder.path() / "." / "input"})
    EXPECT_EQ(check_not_input(file, "--out", {"", other, input}).error().found, "a file that this command reads");
  EXPECT_TRUE(check_not_input(other, "--out", {"", input}));
  EXPECT_TRUE(check_not_input(folder.path() / "new", "--out", {input, folder.path() / "missing"}));
}

TEST(OutputFile, IsNoOtherOutputUnderAnyName) {
  const support::TemporaryFolder folder;
  const fs::path map = folder.path() / "map", link = folder.path() / "link", other = folder.path() / "other";
  fs::create_symlink("map", link);  // which does not exist yet
  EXPECT_TRUE(check_distinct({{"--map", map}, {"--out", other}, {"--none", ""}, {"--neither", ""}}));
  for (const fs::path& file : {map, link, folder.path() / "x" / ".." / "map"}) {
    const Status status = check_distinct({{"--map", map}, {"--out", other}, {"--journal", file}});
    ASSERT_FALSE(status) << file;
    EXPECT_EQ(status.error().key, "--journal");
    EXPECT_EQ(status.error().found, "the file of --map");
  }
}

}  // namespace
}  // namespace bslam
