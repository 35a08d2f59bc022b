// The program in a folder with a simulated recording, for the tests of the command line.
#pragma once

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>

#include "simulator/simulation_writer.h"
#include "support/data_on_disk.h"
#include "synthetic/rigs.h"

namespace bslam {

namespace fs = std::filesystem;

// What a run of the program returned and printed.
struct Ran {
  int status = -1;
  std::string out, err;
};

using support::read_text;

// Runs the program on a simulated recording of four cameras, 1.5 s at 10 Hz, in a folder of its own.
class CommandLine : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = fs::temp_directory_path() / ("bslam_cli_" + std::to_string(::getpid()));
    fs::create_directories(folder_);
    const simulator::SimulationRequest request{.folder = data(),
                                               .rig = synthetic::ring_rig(4, 376),
                                               .recording = {.duration_s = 1.5, .rate_hz = 10},
                                               .tour = {},
                                               .imaging = {},
                                               .world = {.texel = 0.02, .light_texel = 0.8, .ambient_rays = 2}};
    ThreadPool pool(2);
    const auto made = simulator::write_simulation(request, pool);
    ASSERT_TRUE(made.ok()) << made.error().message();
  }
  static void TearDownTestSuite() { fs::remove_all(folder_); }

  static std::string data() { return (folder_ / "data").string(); }
  static std::string out(const std::string& name) { return (folder_ / name).string(); }

  static Ran run(const std::string& arguments) {
    const std::string command =
        std::string(BSLAM_PROGRAM) + " " + arguments + " >" + out("stdout") + " 2>" + out("stderr");
    const int status = std::system(command.c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, read_text(out("stdout")), read_text(out("stderr"))};
  }

  static void expect_rejected(const std::string& arguments) {
    const Ran ran = run(arguments);
    EXPECT_EQ(ran.status, 2) << arguments;
    EXPECT_EQ(ran.err.rfind("bslam: ", 0), 0u) << arguments << ": " << ran.err;
    EXPECT_EQ(std::count(ran.err.begin(), ran.err.end(), '\n'), 1) << arguments << ": " << ran.err;
    EXPECT_FALSE(fs::exists(folder_ / "rejected/trajectory.tum")) << arguments;
  }

  // Runs SLAM on the recording, with fewer features for its small images; the output is in out(name).
  static nlohmann::json summary_of(const std::string& name, const std::string& more) {
    const Ran ran =
        run("run " + data() + " --out " + out(name) + " --set features.per_image=500 --progress never " + more);
    EXPECT_EQ(ran.status, 0) << more << ": " << ran.err;
    return nlohmann::json::parse(read_text(out(name) + "/summary.json"), nullptr, false);
  }

  // Runs the program, interrupts it as soon as ready() is true, and returns its exit status; -1 if it did not exit.
  template <class Ready>
  static int interrupted(const std::string& arguments, const Ready& ready, int signal = SIGINT) {
    const pid_t child = ::fork();
    if (child == 0) {
      const std::string command =
          std::string("exec ") + BSLAM_PROGRAM + " " + arguments + " >/dev/null 2>" + out("stderr");
      ::execl("/bin/sh", "/bin/sh", "-c", command.c_str(), static_cast<char*>(nullptr));
      std::_Exit(127);
    }
    if (child < 0) return -1;
    while (!ready() && ::waitpid(child, nullptr, WNOHANG) == 0) std::this_thread::yield();
    ::kill(child, signal);
    int status = 0;
    return ::waitpid(child, &status, 0) == child && WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

  static void expect_same_trajectories(const std::string& a, const std::string& b) {
    for (const char* file : {"/trajectory.tum", "/trajectory_live.tum"}) {
      EXPECT_GT(read_text(out(a) + file).size(), 1000u);
      EXPECT_EQ(read_text(out(a) + file), read_text(out(b) + file)) << file;
    }
  }

  static inline fs::path folder_;
};

}  // namespace bslam
