// The command-line program: outputs that cannot be written, closed standard streams, and SIGCHLD ignored by the parent
// process.
#include "whole/command_line.h"

namespace bslam {
namespace {

// The exit status of the program with these arguments and redirections.
int status_of(const std::string& arguments) {
  const int status = std::system((std::string(BSLAM_PROGRAM) + " " + arguments).c_str());
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

TEST_F(CommandLine, MessagesThatCannotBePrintedDoNotEndARun) {
  const std::string late = out("late.yaml");
  ASSERT_EQ(run("rig convert " + data() + " " + late).status, 0);
  std::string rig = read_text(late);
  const std::string key = "time_offset_s: 0.0";
  ASSERT_NE(rig.rfind(key), std::string::npos) << rig;
  support::write_text(late, rig.replace(rig.rfind(key), key.size(), "time_offset_s: 0.5"));
  const std::string options = " --rig " + late + " --cameras 0,3 --end 0.3 --progress never --log-level debug --out ";
  EXPECT_NE(run("run " + data() + options + out("warned")).err.find("warning: "), std::string::npos);
  for (const auto& [folder, redirection] :
       {std::pair("no_space", " 2>/dev/full"), std::pair("closed", " 2>&-"), std::pair("nothing", " <&- >&- 2>&-")}) {
    EXPECT_EQ(status_of("run " + data() + options + out(folder) + redirection), 0) << folder;
    EXPECT_TRUE(fs::exists(out(folder) + "/trajectory.tum")) << folder;
    for (const auto& file : fs::directory_iterator(out(folder)))
      EXPECT_EQ(read_text(file.path()).find("debug: frame"), std::string::npos) << file.path();
  }
}

TEST_F(CommandLine, AFullOutputDeviceIsAnErrorButAClosedStdoutIsNot) {
  const std::string truth = data() + "/groundtruth_cam0.tum", errors = " 2>" + out("stderr");
  for (const std::string& command :
       {"rig info " + data(), "eval " + truth + " " + truth, std::string("--version"), std::string("settings")}) {
    EXPECT_EQ(status_of(command + " >/dev/full" + errors), 2) << command;
    const std::string error = read_text(out("stderr"));
    EXPECT_TRUE(error.starts_with("bslam: stdout: found ")) << command << ": " << error;
    EXPECT_TRUE(error.ends_with(", expected an output that can be written\n")) << command << ": " << error;
    EXPECT_EQ(std::ranges::count(error, '\n'), 1) << command << ": " << error;
    // A closed stdout is opened as /dev/null (cli/standard_streams.h).
    EXPECT_EQ(status_of(command + " >&-" + errors), 0) << command;
    EXPECT_EQ(read_text(out("stderr")), "") << command;
  }
}

// Calls fork and exec directly, since a shell would reset SIGCHLD.
TEST_F(CommandLine, ReportsAFailedChildProcessEvenIfSigchldIsIgnored) {
  const std::string file = out("children.rrd"), folder = out("children"), errors = out("stderr");
  const pid_t child = ::fork();
  if (child == 0) {
    std::signal(SIGCHLD, SIG_IGN);
    ::setenv("BSLAM_PYTHON", "/bin/false", 1);
    const bool redirected = std::freopen(errors.c_str(), "w", stderr) != nullptr;
    if (redirected)
      ::execl(BSLAM_PROGRAM, "bslam", "run", data().c_str(), "--out", folder.c_str(), "--rerun", file.c_str(),
              static_cast<char*>(nullptr));
    std::_Exit(127);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 2);
  EXPECT_NE(read_text(errors).find("--rerun needs the Python packages"), std::string::npos) << read_text(errors);
  EXPECT_FALSE(fs::exists(folder));
}

}  // namespace
}  // namespace bslam
