// The command-line program: live runs, and what they record.
#include <algorithm>
#include <map>
#include <vector>

#include "whole/command_line.h"

namespace bslam {
namespace {

// Two cameras of the recording as folders that are played, and two that are not there.
std::string live_arguments(const std::string& data) {
  return "live --rig " + data + "/rig.yaml --cameras " + data + "/mav0/cam0," + data +
         "/mav0/cam1,-,- --set features.per_image=500 --progress never ";
}

TEST_F(CommandLine, RecordedLiveRunIsRepeatedToTheByte) {
  const std::string file = out("live.mcap"), journal = out("live.journal");
  const Ran live = run(live_arguments(data()) + "--out " + out("live") + " --record " + file + " --journal " + journal);
  ASSERT_EQ(live.status, 0) << live.err;
  EXPECT_EQ(nlohmann::json::parse(read_text(out("live/summary.json")))["complete"], true);
  EXPECT_TRUE(fs::exists(out("live/report.html")));
  const Ran again =
      run("run " + file + " --out " + out("live_again") + " --replay " + journal + " --set features.per_image=500");
  ASSERT_EQ(again.status, 0) << again.err;
  expect_same_trajectories("live", "live_again");
  const auto seconds = [](const std::string& name) {
    return nlohmann::json::parse(read_text(out(name + "/summary.json")))["parts"];
  };
  EXPECT_EQ(seconds("live"), seconds("live_again"));
}

// The recording has the number that the camera has in the rig file, which is in the trajectory.
TEST_F(CommandLine, RecordedLiveRunWithoutCamera0HasTheSameFrameAgain) {
  const std::string file = out("live_second.mcap"), options = " --mode sequential --set features.per_image=500 --out ";
  const Ran live = run("live --rig " + data() + "/rig.yaml --cameras -," + data() + "/mav0/cam1,-,- --duration 0.5" +
                       options + out("live_second") + " --record " + file);
  ASSERT_TRUE(live.status == 0 || live.status == 3) << live.err;
  const Ran again = run("run " + file + options + out("live_second_again"));
  EXPECT_EQ(again.status, live.status) << again.err;
  const std::string trajectory = read_text(out("live_second/trajectory.tum"));
  EXPECT_EQ(trajectory.rfind("# bslam trajectory frame=cam1 ", 0), 0u) << trajectory;
  EXPECT_EQ(read_text(out("live_second_again/trajectory.tum")), trajectory);
}

TEST_F(CommandLine, CtrlCEndsALiveRunWithAllItsFiles) {
  const std::string file = out("ended.mcap"), folder = out("ended");
  // Frames are in the file after half a second of 1.5 s.
  const auto recorded = [&] {
    std::error_code error;
    return fs::file_size(file, error) > 50'000 && !error;
  };
  EXPECT_EQ(interrupted(live_arguments(data()) + "--out " + folder + " --record " + file, recorded), 0)
      << read_text(out("stderr"));
  const auto summary = nlohmann::json::parse(read_text(folder + "/summary.json"));
  EXPECT_EQ(summary["complete"], true);
  EXPECT_GT(summary["frames"]["tracked"], 0);
  EXPECT_TRUE(fs::exists(folder + "/trajectory.tum"));
  EXPECT_EQ(run("data info " + file).err, "");
}

// The only images of these cameras come before the run begins.
TEST_F(CommandLine, ALiveRunWithoutAFrameKeepsEarlierFiles) {
  std::string cameras;
  for (const char* name : {"cam0", "cam1"}) {
    const fs::path images = fs::path(data()) / "mav0" / name / "data", first = folder_ / "first_image" / name;
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(images)) files.push_back(entry.path());
    fs::create_directories(first);
    fs::copy(std::ranges::min(files), first);
    cameras += first.string() + ",";
  }
  const std::map<std::string, std::string> earlier = {
      {out("frameless/summary.json"), "{}"}, {out("site.bmap"), "BSLAMMAP"}, {out("walk.mcap"), "\x89MCAP0\r\n"}};
  for (const auto& [file, text] : earlier) support::write_text(file, text);
  const Ran ran = run("live --rig " + data() + "/rig.yaml --cameras " + cameras + "-,- --overwrite --out " +
                      out("frameless") + " --save-map " + out("site.bmap") + " --record " + out("walk.mcap"));
  EXPECT_EQ(ran.status, 3) << ran.err;
  EXPECT_NE(
      ran.err.find("the run ended before its first frame; the earlier results in " + out("frameless") + " are kept\n"),
      std::string::npos)
      << ran.err;
  for (const auto& [file, text] : earlier) EXPECT_EQ(read_text(file), text) << file;
}

TEST_F(CommandLine, RejectsBadRequestsForLiveRuns) {
  const std::string rig = "--rig " + data() + "/rig.yaml ", folder = " --out " + out("rejected");
  expect_rejected("live --cameras a,b" + folder);
  expect_rejected("live " + rig + folder);
  expect_rejected("live " + rig + "--cameras /dev/null,-,-,-");
  expect_rejected("live " + rig + "--cameras /dev/null,-,-,-" + folder);
  expect_rejected("live " + rig + "--cameras /nowhere/video0,-,-,-" + folder);
  expect_rejected("live " + rig + "--cameras -,-,-,-" + folder);
  expect_rejected("live " + rig + "--cameras /dev/video0" + folder);
  expect_rejected("live " + rig + "--cameras /dev/null,/dev/null,-,-" + folder);
  expect_rejected("live " + rig + "--cameras /dev/null,-,-,- --exposure bright" + folder);
  expect_rejected("live " + rig + "--cameras /dev/null,-,-,- --pixels RGB" + folder);
  // Before cameras are opened, of which there are none.
  const std::string none = "live " + rig + "--cameras /nowhere/video0,-,-,- ";
  for (const auto& [arguments, message] :
       {std::pair("--record /nowhere/a.mcap" + folder, "/nowhere: --record: found no such folder"),
        std::pair("--record " + out("a.bag") + folder, "a.bag, expected the name of an MCAP file"),
        std::pair("--save-map /nowhere/a.bmap" + folder, "/nowhere: --save-map: found no such folder"),
        std::pair("--rerun " + data() + "/rig.yaml" + folder, "--rerun: found an existing file"),
        std::pair("--overwrite --save-map " + data() + "/rig.yaml" + folder,
                  "--save-map: found an existing file of another kind"),
        std::pair("--overwrite --journal " + data() + "/rig.yaml" + folder,
                  "--journal: found an existing file of another kind"),
        std::pair(" --out " + data(), "--out: found a folder that is not empty"),
        std::pair("--out " + data() + "/rig.yaml/out", "--out: found "),
        std::pair("--duration 0" + folder, "--duration: found 0")}) {
    const Ran ran = run(none + arguments);
    EXPECT_EQ(ran.status, 2) << arguments;
    EXPECT_NE(ran.err.find(message), std::string::npos) << arguments << ": " << ran.err;
  }
  const std::string played = "live " + rig + "--cameras " + data() + "/mav0/cam0,-,-,-" + folder;
  for (const char* setting : {" --fps 10", " --exposure auto", " --pixels GREY"}) expect_rejected(played + setting);
  EXPECT_EQ(run("live --list").status, 0);
}

}  // namespace
}  // namespace bslam
