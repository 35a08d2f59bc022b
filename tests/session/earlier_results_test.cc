#include "session/earlier_results.h"

#include <gtest/gtest.h>

#include <map>
#include <string>

#include "support/data_on_disk.h"

namespace bslam::session {
namespace {

namespace fs = std::filesystem;

// The files below a folder, by their names relative to it.
std::map<std::string, std::string> files_below(const fs::path& folder) {
  std::map<std::string, std::string> out;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file())
      out[entry.path().lexically_relative(folder).string()] = support::read_text(entry.path());
  }
  return out;
}

// Without trajectory.tum, so that the files of the submaps do not begin with the first one.
void write_results(const fs::path& folder) {
  for (const char* name : {"summary.json", "trajectory_part2.tum", "trajectory_part12.tum", "trajectory_live.tum",
                           "covariance_live.csv", "config.yaml", "my_notes.txt", "trajectory_part2.tum.orig"})
    support::write_text(folder / name, name);
}

TEST(EarlierResults, AreTheFilesOfARun) {
  for (const char* name :
       {"trajectory.tum", "trajectory_live.tum", "trajectory_part2.tum", "trajectory_live_part10.tum",
        "covariance_live.csv", "summary.json", "report.html", "rig_refined.yaml"})
    EXPECT_TRUE(is_result_file(name)) << name;
  for (const char* name : {"", ".tum", "trajectory_part.tum", "trajectory_part2b.tum", "trajectory_mine.tum",
                           "my_trajectory.tum", "rig.yaml", "trajectory.csv"})
    EXPECT_FALSE(is_result_file(name)) << name;
}

TEST(EarlierResults, AreMovedBackUnlessTheRunReplacesThem) {
  const support::TemporaryFolder folder;
  write_results(folder.path());
  const auto before = files_below(folder.path());
  {
    const auto results = EarlierResults::move_aside(folder.path(), {});
    ASSERT_TRUE(results);
    EXPECT_FALSE(fs::exists(folder.path() / "trajectory_part2.tum"));
    EXPECT_FALSE(fs::exists(folder.path() / "covariance_live.csv"));
    EXPECT_TRUE(fs::exists(folder.path() / "my_notes.txt"));
    EXPECT_EQ(support::read_text(folder.path() / "earlier_results/summary.json"), "summary.json");
  }
  EXPECT_EQ(files_below(folder.path()), before);
  EXPECT_FALSE(fs::exists(folder.path() / "earlier_results"));
}

TEST(EarlierResults, AreRemovedWithThoseThatAKilledRunHasLeft) {
  const support::TemporaryFolder folder;
  write_results(folder.path());
  support::write_text(folder.path() / "earlier_results/report.html", "left");
  auto results = EarlierResults::move_aside(folder.path(), {});
  ASSERT_TRUE(results);
  results->replace();
  const std::map<std::string, std::string> kept = {{"my_notes.txt", "my_notes.txt"},
                                                   {"trajectory_part2.tum.orig", "trajectory_part2.tum.orig"}};
  EXPECT_EQ(files_below(folder.path()), kept);
  EXPECT_FALSE(fs::exists(folder.path() / "earlier_results"));
}

TEST(EarlierResults, OfAKilledRunAreRemovedByACompleteRunOnly) {
  const support::TemporaryFolder folder;
  const fs::path left = folder.path() / "earlier_results/summary.json", mine = folder.path() / "summary.json";
  support::write_text(left, "left");
  for (const bool replaced : {false, true}) {
    support::write_text(mine, "interrupted");
    auto results = EarlierResults::move_aside(folder.path(), {});
    ASSERT_TRUE(results);
    EXPECT_TRUE(results->any());
    EXPECT_FALSE(fs::exists(mine));
    EXPECT_EQ(support::read_text(left), "left");
    if (replaced) results->replace(false);
  }
  EXPECT_EQ(files_below(folder.path()), (std::map<std::string, std::string>{{"earlier_results/summary.json", "left"}}));
  EXPECT_FALSE(fs::exists(folder.path() / "earlier_results_2"));
  auto results = EarlierResults::move_aside(folder.path(), {});
  ASSERT_TRUE(results);
  EXPECT_FALSE(results->any());
  results->replace(true);
  EXPECT_TRUE(files_below(folder.path()).empty());
}

TEST(EarlierResults, AreNeitherInputsNorFolders) {
  const support::TemporaryFolder folder;
  write_results(folder.path());
  fs::create_directories(folder.path() / "run.svg/mine");
  auto results = EarlierResults::move_aside(folder.path(), {fs::path(), folder.path() / "." / "config.yaml"});
  ASSERT_TRUE(results);
  results->replace();
  EXPECT_TRUE(fs::exists(folder.path() / "config.yaml"));
  EXPECT_TRUE(fs::exists(folder.path() / "run.svg/mine"));
}

TEST(EarlierResults, AreWhereTheyWereIfTheyCannotBeMoved) {
  const support::TemporaryFolder folder;
  write_results(folder.path());
  support::write_text(folder.path() / "earlier_results/summary.json/in the way", "");
  const auto before = files_below(folder.path());
  EXPECT_EQ(EarlierResults::move_aside(folder.path(), {}).error().file, (folder.path() / "summary.json").string());
  EXPECT_EQ(files_below(folder.path()), before);
}

}  // namespace
}  // namespace bslam::session
