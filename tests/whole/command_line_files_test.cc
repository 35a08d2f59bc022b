// The command-line program: what becomes of files that exist already, and numbers that are none.
#include <array>
#include <fstream>
#include <map>
#include <vector>

#include "rig_formats/rig_file.h"
#include "whole/command_line.h"

namespace bslam {
namespace {

// The files in a folder and what they contain.
std::map<std::string, std::string> files_in(const std::string& folder) {
  std::map<std::string, std::string> out;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.is_regular_file()) out[entry.path().filename()] = read_text(entry.path());
  }
  return out;
}

TEST_F(CommandLine, ARunThatFailsKeepsTheResultsOfTheEarlierOne) {
  summary_of("kept", "--cameras 0,1 --mode sequential --journal " + out("kept.journal"));
  fs::rename(out("kept/trajectory.tum"), out("kept/trajectory_part2.tum"));  // as if of a further submap
  support::write_text(out("kept/notes.txt"), "mine");
  const auto before = files_in(out("kept"));
  const std::string again = "run " + data() +
                            " --cameras 0,1 --mode sequential --overwrite --no-report --progress never " +
                            "--set features.per_image=300 --out " + out("kept");
  const Ran failed = run(again + " --replay " + out("kept.journal"));
  EXPECT_EQ(failed.status, 2) << failed.err;
  EXPECT_EQ(files_in(out("kept")), before);
  EXPECT_FALSE(fs::exists(out("kept/earlier_results")));
  const Ran same = run(again + " --replay " + out("kept.journal") + " --journal " + out("kept.journal"));
  EXPECT_NE(same.err.find("--journal: found a file that this command reads"), std::string::npos) << same.err;

  ASSERT_EQ(run(again).status, 0);
  EXPECT_FALSE(fs::exists(out("kept/trajectory_part2.tum")));
  EXPECT_FALSE(fs::exists(out("kept/report.html")));
  EXPECT_FALSE(fs::exists(out("kept/earlier_results")));
  EXPECT_EQ(read_text(out("kept/notes.txt")), "mine");
  EXPECT_NE(read_text(out("kept/summary.json")), before.at("summary.json"));
}

TEST_F(CommandLine, ARunThatIsKilledLeavesTheEarlierResultsInAFolderOfTheirOwn) {
  const std::string folder = out("killed"), again = "run " + data() + " --overwrite --progress never --out " + folder;
  summary_of("killed", "--cameras 0,1 --end 0.3 --no-report");
  const std::string trajectory = read_text(folder + "/trajectory.tum");
  interrupted(
      again + " --pace realtime", [&] { return fs::exists(folder + "/earlier_results/trajectory_live.tum"); }, SIGKILL);
  EXPECT_EQ(files_in(folder).count("trajectory.tum"), 0u);
  EXPECT_EQ(files_in(folder).count("summary.json"), 0u);
  EXPECT_EQ(read_text(folder + "/earlier_results/trajectory.tum"), trajectory);
  EXPECT_EQ(run(again + " --end 0.3").status, 0);
  EXPECT_TRUE(fs::exists(folder + "/trajectory.tum"));
  EXPECT_FALSE(fs::exists(folder + "/earlier_results"));
}

TEST_F(CommandLine, NoFileThatIsReadAndNoneOfAnotherKindIsReplaced) {
  fs::copy(data() + "/rig.yaml", out("rough.yaml"));
  fs::create_directories(out("photographs"));
  const auto first = fs::directory_iterator(data() + "/mav0/cam0/data")->path();
  const std::string photograph = out("photographs/0.png");
  fs::copy(first, photograph);
  std::ofstream(out("photographs/1.png"));  // empty
  support::write_text(out("notes.txt"), "mine");
  support::write_text(out("settings.yaml"), "features: {per_image: 500}\n");
  const std::string calibrate = "rig calibrate " + data() + " --cameras 0,1 --overwrite --config " +
                                out("settings.yaml") + " --rig " + out("rough.yaml") + " --out ",
                    train = "vocab train " + out("photographs") + " --overwrite --out ",
                    is_read = "--out: found a file that this command reads",
                    is_other = "an existing file of another kind";
  const std::string uncalibrated = "rig calibrate " + data() + " --overwrite --out ";
  const std::vector<std::array<std::string, 3>> all = {{uncalibrated, data() + "/mav0/cam0/sensor.yaml", is_read},
                                                       {calibrate, out("rough.yaml"), is_read},
                                                       {calibrate, out("settings.yaml"), is_read},
                                                       {calibrate, out("notes.txt"), is_other},
                                                       {calibrate, photograph, is_other},
                                                       {train, photograph, is_read},
                                                       {train, out("photographs/1.png"), is_read},
                                                       {train, out("notes.txt"), is_other}};
  for (const auto& [command, file, message] : all) {
    const std::string before = read_text(file);
    expect_rejected(command + file);
    EXPECT_NE(read_text(out("stderr")).find(message), std::string::npos) << read_text(out("stderr"));
    EXPECT_EQ(read_text(file), before);
  }
}

// Its resolution is that of the images. Several cameras cannot be matched without their poses.
TEST_F(CommandLine, TheCalibrationOfASingleCameraNeedsNoRigFile) {
  fs::create_directories(out("clip"));
  fs::create_directory_symlink(fs::absolute(data()) / "mav0/cam0/data", out("clip/left"));
  const std::string calibrate = "rig calibrate " + out("clip") + " --model pinhole-radtan --fov 90 --progress never " +
                                "--set features.per_image=300 --out " + out("camera.yaml");
  const Ran one = run(calibrate);
  ASSERT_EQ(one.status, 0) << one.err;
  const auto found = rig_formats::read_rig(out("camera.yaml")), truth = rig_formats::read_rig(data() + "/rig.yaml");
  ASSERT_TRUE(found.ok() && truth.ok());
  ASSERT_EQ(found->size(), 1u);
  EXPECT_EQ(found->camera(0).width, truth->camera(0).width);
  EXPECT_EQ(found->camera(0).height, truth->camera(0).height);
  fs::create_directory_symlink(fs::absolute(data()) / "mav0/cam1/data", out("clip/right"));
  const Ran two = run(calibrate + " --overwrite");
  EXPECT_EQ(two.status, 2);
  EXPECT_NE(two.err.find("no calibration in "), std::string::npos) << two.err;
}

TEST_F(CommandLine, EvalSaysIfItsFilesAreExchanged) {
  const std::string truth = data() + "/groundtruth_cam0.tum", estimate = out("estimate.tum");
  support::write_text(estimate, "# bslam trajectory frame=cam0 parent=world final=true\n" + read_text(truth));
  const std::string note = "note: " + estimate + " was estimated by bslam, but is given as the ground truth";
  EXPECT_NE(run("eval " + truth + " " + estimate).err.find(note), std::string::npos);
  for (const std::string& files : {estimate + " " + truth, estimate + " " + estimate, truth + " " + truth})
    EXPECT_EQ(run("eval " + files).err.find("note: "), std::string::npos) << files;
}

// The calibration and the trajectory exist, and are inputs.
TEST_F(CommandLine, AnOutputReplacesNeitherItsInputNorAFileOfAnotherKind) {
  const std::string truth = out("truth.tum"), rig = out("mine.yaml"), notes = out("notes.svg");
  fs::copy_file(data() + "/groundtruth_cam0.tum", truth);
  fs::copy_file(data() + "/rig.yaml", rig);
  fs::create_symlink(rig, out("mine.svg"));
  support::write_text(notes, "precious");
  const std::string inspect = "inspect " + data() + " --frame 0 --rig " + rig + " --out ", info = "rig info " + rig;
  const std::string eval = "eval " + truth + " " + truth + " --plot ";
  const std::string input = "found a file that this command reads", other = "found an existing file of another kind";
  for (const auto& [arguments, message] :
       {std::pair(inspect + rig, input), std::pair(inspect + notes, other), std::pair(info + " --svg " + rig, input),
        std::pair(info + " --svg " + out("mine.svg"), input), std::pair(info + " --svg " + notes, other),
        std::pair(eval + notes, other), std::pair("export " + truth + " --overwrite --out " + truth, input),
        std::pair("export " + truth + " --rig " + rig + " --frame body --overwrite --out " + rig, input)}) {
    expect_rejected(arguments);
    EXPECT_NE(run(arguments).err.find(message), std::string::npos) << arguments << ": " << run(arguments).err;
  }
  fs::rename(truth, out("truth"));  // a name without extension passes as that of a plot
  expect_rejected("eval " + out("truth") + " " + out("truth") + " --plot " + out("truth"));
  EXPECT_EQ(read_text(out("truth")), read_text(data() + "/groundtruth_cam0.tum"));
  EXPECT_EQ(read_text(rig), read_text(data() + "/rig.yaml"));
  EXPECT_EQ(read_text(notes), "precious");
}

TEST_F(CommandLine, EveryOutputOfARunHasItsOwnFile) {
  const std::string base = "run " + data() + " --out " + out("own") + " ", file = out("both");
  for (const auto& [arguments, message] :
       {std::pair("--save-map " + file + " --journal " + file, "--journal: found the file of --save-map"),
        std::pair("--save-map " + out("own"), "--out: found the file of --save-map"),
        std::pair("--journal " + out("own/summary.json"), "--journal: found the name of a result of the run")}) {
    const Ran ran = run(base + arguments);
    EXPECT_EQ(ran.status, 2) << arguments;
    EXPECT_NE(ran.err.find(message), std::string::npos) << arguments << ": " << ran.err;
    EXPECT_FALSE(fs::exists(out("own"))) << arguments;
  }
}

// The times of KITTI poses, and the calibration in a folder.
TEST_F(CommandLine, AnOutputDoesNotReplaceAnInputThatIsNotNamed) {
  const std::string poses = out("kitti/poses.txt"), times = out("kitti/times.txt"), rig = out("same.yaml");
  fs::create_directory(out("kitti"));
  const std::string truth = data() + "/groundtruth_cam0.tum", sensor = data() + "/mav0/cam0/sensor.yaml";
  ASSERT_EQ(run("export " + truth + " --format kitti --out " + poses).status, 0);
  fs::copy_file(data() + "/rig.yaml", rig);
  const std::string recorded_times = read_text(times), calibration = read_text(sensor);
  for (const std::string& arguments :
       {"export " + poses + " --overwrite --out " + times,
        "export " + poses + " --format kitti --overwrite --out " + out("kitti/others.txt"),
        "export " + truth + " --rig " + times + " --format kitti --overwrite --out " + out("kitti/others.txt"),
        "rig convert " + rig + " " + rig + " --overwrite", "rig convert " + rig + " " + rig,
        "rig convert " + data() + " " + data() + " --overwrite",
        "rig convert " + data() + " " + sensor + " --overwrite"}) {
    expect_rejected(arguments);
    EXPECT_NE(run(arguments).err.find("found a file that this command reads"), std::string::npos)
        << arguments << ": " << run(arguments).err;
  }
  EXPECT_EQ(read_text(times), recorded_times);
  EXPECT_EQ(read_text(sensor), calibration);
  EXPECT_EQ(read_text(rig), read_text(data() + "/rig.yaml"));
  EXPECT_EQ(run("export " + truth + " --overwrite --out " + times).status, 0);  // no input of this command
}

TEST_F(CommandLine, APlotADrawingAndAFrameReplaceAnEarlierOne) {
  const std::string truth = data() + "/groundtruth_cam0.tum";
  for (const std::string& command : {"inspect " + data() + " --frame 0 --out " + out("again.json"),
                                     "rig info " + data() + " --svg " + out("rig.svg"),
                                     "eval " + truth + " " + truth + " --plot " + out("again.svg")}) {
    for (int k = 0; k < 2; ++k) EXPECT_EQ(run(command).status, 0) << command;
  }
}

TEST_F(CommandLine, AnExportDoesNotReplaceItsMap) {
  const std::string map = out("own.bmap"), linked = out("linked.bmap"), before_link = out("behind.bmap");
  fs::create_symlink(before_link, linked);
  summary_of("exported_map", "--cameras 0,1 --save-map " + linked);
  EXPECT_TRUE(fs::is_symlink(linked));  // its target was written
  fs::copy_file(before_link, map);
  const std::string bytes = read_text(map);
  support::write_text(out("poem.ply"), "precious");
  for (const char* format : {"ply", "g2o", "octomap"}) {
    const std::string command = "map export " + map + " --format " + format + " --overwrite --out ";
    expect_rejected(command + map);
    EXPECT_NE(run(command + map).err.find("found a file that this command reads"), std::string::npos) << format;
    expect_rejected(command + out("poem.ply"));
    const std::string file = out(std::string("of_map.") + format);
    for (int k = 0; k < 2; ++k) EXPECT_EQ(run(command + file).status, 0) << format;
  }
  expect_rejected("map merge " + map + " --overwrite --out " + out("poem.ply"));
  const std::string onto_itself = "map merge " + map + " --overwrite --out " + map;
  expect_rejected(onto_itself);
  EXPECT_NE(run(onto_itself).err.find("found a file that this command reads"), std::string::npos);
  expect_rejected("map transfer " + out("exported_map/trajectory.tum") + " --from " + map + " --to " + map +
                  " --overwrite --out " + map);
  const Ran moved = run("map transfer " + out("exported_map/trajectory.tum") + " --from " + map + " --to " + map +
                        " --out " + out("moved.tum"));
  EXPECT_NE(moved.out.find(" keyframes that both maps contain, are in the frame world\n"), std::string::npos)
      << moved.out << moved.err;
  EXPECT_EQ(read_text(map), bytes);
  EXPECT_EQ(read_text(out("poem.ply")), "precious");
  summary_of("exported_map", "--cameras 0,1 --end 0.5 --overwrite --save-map " + linked);
  EXPECT_TRUE(fs::is_symlink(linked));
  EXPECT_NE(read_text(before_link), bytes);
}

TEST_F(CommandLine, ATransferredTrajectoryKeepsItsComments) {
  const std::string map = out("transferred.bmap"), moved = out("transferred.tum");
  summary_of("transferred", "--cameras 0,1 --image-stamps --save-map " + map);
  std::string text = read_text(out("transferred/trajectory.tum"));
  text.insert(text.find('\n') + 1, "# scale=up-to-scale: lengths are not in metres\n");
  support::write_text(out("of_one_camera.tum"), text);
  const Ran ran =
      run("map transfer " + out("of_one_camera.tum") + " --from " + map + " --to " + map + " --out " + moved);
  ASSERT_EQ(ran.status, 0) << ran.err;
  EXPECT_NE(read_text(moved).find("\n# scale=up-to-scale: lengths are not in metres\n"), std::string::npos);
  EXPECT_NE(read_text(moved).find("\n# time stamps are those of the images"), std::string::npos);
  const Ran other = run("map transfer " + data() + "/groundtruth_cam0.tum --from " + map + " --to " + map + " --out " +
                        out("never.tum"));
  EXPECT_EQ(other.status, 2);
  EXPECT_NE(other.err.find("keyframes: found none with the time and the pose of a pose of the trajectory"),
            std::string::npos)
      << other.err;
}

TEST_F(CommandLine, NumbersAreFinite) {
  const std::string base = "run " + data() + " --out " + out("rejected");
  const std::vector<std::string> all = {base + " --rate nan",
                                        base + " --begin nan",
                                        base + " --end inf",
                                        base + " --end 1e999",
                                        "eval a b --max-dt nan",
                                        "eval a b --delta nan",
                                        "map export m --out x --resolution nan",
                                        "map export m --out x --max-range nan",
                                        "map export m --out x --height nan 1",
                                        "map export m --out x --height -inf 1",
                                        "live --duration nan",
                                        "live --fps nan",
                                        "bench " + data() + " --time --margin nan",
                                        "simulate --out x --duration inf",
                                        "simulate --out x --noise nan",
                                        "rig calibrate " + data() + " --out x --model pinhole --fov nan"};
  for (const std::string& arguments : all) {
    const Ran ran = run(arguments);
    EXPECT_EQ(ran.status, 2) << arguments;
    EXPECT_TRUE(ran.err.starts_with("bslam: command line: --")) << arguments << ": " << ran.err;
    EXPECT_TRUE(ran.err.ends_with(", expected a finite number\n")) << arguments << ": " << ran.err;
  }
  EXPECT_NE(run("eval a b --max-dt inf").err.find("--max-dt: found inf, expected a number from 0 to 1000000\n"),
            std::string::npos);
}

}  // namespace
}  // namespace bslam
