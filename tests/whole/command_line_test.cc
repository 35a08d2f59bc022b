// The program as a user meets it: exit status, one line on what is wrong, files that are whole or not there.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <thread>

namespace bslam {
namespace {

namespace fs = std::filesystem;

struct Ran {
  int status = -1;
  std::string out, err;
};

std::string slurp(const fs::path& file) {
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

class CommandLine : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = fs::temp_directory_path() / ("bslam_cli_" + std::to_string(::getpid()));
    fs::create_directories(folder_);
    const Ran made = run("simulate --out " + data() + " --duration 1.5 --rate 10 --progress never");
    ASSERT_EQ(made.status, 0) << made.err;
  }
  static void TearDownTestSuite() { fs::remove_all(folder_); }

  static std::string data() { return (folder_ / "data").string(); }
  static std::string out(const std::string& name) { return (folder_ / name).string(); }

  static Ran run(const std::string& arguments) {
    const std::string command = std::string(BSLAM_PROGRAM) + " " + arguments + " >" + out("stdout") + " 2>" + out("stderr");
    const int status = std::system(command.c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, slurp(out("stdout")), slurp(out("stderr"))};
  }

  static void expect_refused(const std::string& arguments) {
    const Ran ran = run(arguments);
    EXPECT_EQ(ran.status, 2) << arguments;
    EXPECT_EQ(ran.err.rfind("bslam: ", 0), 0u) << arguments << ": " << ran.err;
    EXPECT_EQ(std::count(ran.err.begin(), ran.err.end(), '\n'), 1) << arguments << ": " << ran.err;
    EXPECT_FALSE(fs::exists(folder_ / "refused/trajectory.tum")) << arguments;
  }

  static inline fs::path folder_;
};

TEST_F(CommandLine, TellsItsVersionAndHelpOnEveryVerb) {
  EXPECT_EQ(run("--version").status, 0);
  EXPECT_NE(run("--version").out.find("Eigen"), std::string::npos);
  for (const char* verb : {"", "run", "eval", "simulate", "inspect", "rig", "rig info", "rig convert"}) {
    EXPECT_EQ(run(std::string(verb) + " --help").status, 0) << verb;
  }
}

TEST_F(CommandLine, RefusesWhatMakesNoSense) {
  const std::string base = "run " + data() + " --out " + out("refused") + " --progress never ";
  for (const char* more : {"--set no.such.key=1", "--set features.per_image=-5", "--set features.per_image=many", "--set seed",
                           "--cameras 0,9", "--cameras 0,0", "--cameras a", "--cameras 0,", "--cameras ''", "--mode sideways", "--begin 5 --end 1", "--begin 99",
                           "--format bag", "--pace slow", "--seed -1", "--config /no/such/file", "--rig /no/such/file", "--bogus"}) {
    expect_refused(base + more);
  }
  expect_refused("run /no/such/folder --out " + out("refused"));
  expect_refused("run " + data());
  expect_refused("frobnicate");
  expect_refused("");
  expect_refused("eval /no/such/file " + data() + "/groundtruth_cam0.tum");
  expect_refused("inspect " + data() + " --frame 999 --out " + out("frame.json"));
  expect_refused("rig info /no/such/file");
  expect_refused("simulate --out " + out("never") + " --duration -1");
}

TEST_F(CommandLine, RunWritesItsFilesAndRepeatsFromItsConfiguration) {
  const Ran first = run("run " + data() + " --out " + out("first") + " --mode sequential --progress never --set features.per_image=700");
  ASSERT_EQ(first.status, 0) << first.err;
  for (const char* file : {"trajectory.tum", "trajectory_live.tum", "summary.json", "config.yaml", "trajectory.svg", "run.svg"}) {
    EXPECT_TRUE(fs::exists(folder_ / "first" / file)) << file;
  }
  const auto summary = nlohmann::json::parse(slurp(folder_ / "first/summary.json"));
  EXPECT_EQ(summary["schema"], 1);
  EXPECT_EQ(summary["complete"], true);
  EXPECT_EQ(summary["frames"]["input"], 15);
  EXPECT_EQ(summary["frames"]["tracked"], 15);
  EXPECT_EQ(summary["map"]["scale"], "metric");
  EXPECT_NE(slurp(folder_ / "first/trajectory.tum").find("# bslam trajectory frame=cam0 parent=world final=true\n"), std::string::npos);

  const Ran again = run("run " + data() + " --out " + out("again") + " --progress never --config " + out("first/config.yaml"));
  ASSERT_EQ(again.status, 0) << again.err;
  EXPECT_EQ(slurp(folder_ / "first/trajectory.tum"), slurp(folder_ / "again/trajectory.tum"));
  expect_refused("run " + data() + " --out " + out("again"));  // it is there, and --overwrite was not given
}

TEST_F(CommandLine, InspectShowsABundledTableThatHoldsTogether) {
  const Ran ran = run("inspect " + data() + " --frame 3 --out " + out("frame.json"));
  ASSERT_EQ(ran.status, 0) << ran.err;
  const auto frame = nlohmann::json::parse(slurp(out("frame.json")));
  std::size_t keypoints = 0, seen = 0, matched = 0;
  for (const auto& camera : frame["cameras"]) keypoints += camera["keypoints"].size();
  for (const auto& feature : frame["features"]) {
    seen += feature["observations"].size();
    matched += feature["observations"].size() > 1;
  }
  EXPECT_EQ(seen, keypoints);
  EXPECT_GT(matched, 100u);
}

TEST_F(CommandLine, InterruptedRunKeepsWhatItHasAndSaysSo) {
  const std::string folder = out("interrupted");
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    const std::string path = data();
    std::freopen("/dev/null", "w", stdout);
    ::execl(BSLAM_PROGRAM, BSLAM_PROGRAM, "run", path.c_str(), "--out", folder.c_str(), "--pace", "realtime", "--progress", "never",
            static_cast<char*>(nullptr));
    std::_Exit(127);
  }
  // Its folder appears before the first frame; at the recorded pace the run then lasts a second and a half.
  while (!fs::exists(folder) && ::waitpid(child, nullptr, WNOHANG) == 0) std::this_thread::yield();
  ::kill(child, SIGINT);
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFEXITED(status)) << status;
  EXPECT_EQ(WEXITSTATUS(status), 130);
  EXPECT_EQ(nlohmann::json::parse(slurp(folder + "/summary.json"))["complete"], false);
}

}  // namespace
}  // namespace bslam
