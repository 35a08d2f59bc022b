// The command-line program: the files of runs, which are written completely or not at all.
#include <tuple>

#include "calibration/rig_warnings.h"
#include "evaluation/trajectory_file.h"
#include "rig_formats/rig_file.h"
#include "whole/command_line.h"

namespace bslam {
namespace {

TEST_F(CommandLine, RunWritesItsFilesAndIsRepeatableFromItsConfiguration) {
  const Ran first = run("run " + data() + " --out " + out("first") +
                        " --mode sequential --progress never --set features.per_image=700");
  ASSERT_EQ(first.status, 0) << first.err;
  for (const char* file : {"trajectory.tum", "trajectory_live.tum", "summary.json", "config.yaml", "trajectory.svg",
                           "run.svg", "report.html"}) {
    EXPECT_TRUE(fs::exists(folder_ / "first" / file)) << file;
  }
  const auto summary = nlohmann::json::parse(read_text(folder_ / "first/summary.json"));
  EXPECT_EQ(summary["schema"], 1);
  EXPECT_EQ(summary["complete"], true);
  EXPECT_EQ(summary["frames"]["input"], 15);
  EXPECT_EQ(summary["frames"]["tracked"], 15);
  EXPECT_EQ(summary["map"]["scale"], "metric");
  EXPECT_NE(read_text(folder_ / "first/trajectory.tum").find("# bslam trajectory frame=cam0 parent=world final=true\n"),
            std::string::npos);

  const Ran again =
      run("run " + data() + " --out " + out("again") + " --progress never --config " + out("first/config.yaml"));
  ASSERT_EQ(again.status, 0) << again.err;
  EXPECT_EQ(read_text(folder_ / "first/trajectory.tum"), read_text(folder_ / "again/trajectory.tum"));
  EXPECT_NE(read_text(folder_ / "first/report.html").find("--set features.per_image=700"), std::string::npos);
  EXPECT_EQ(run("run " + data() + " --out " + out("again") + " --overwrite --no-report --end 0.3").status, 0);
  EXPECT_FALSE(fs::exists(folder_ / "again/report.html"));      // that of the earlier run is removed
  expect_rejected("run " + data() + " --out " + out("again"));  // exists already, and --overwrite is not given

  // A refined rig of an earlier run is removed, unless it is an input of this run.
  const std::filesystem::path refined = folder_ / "again/rig_refined.yaml";
  std::filesystem::copy_file(folder_ / "data/rig.yaml", refined);
  const std::string overwrite = "run " + data() + " --end 0.2 --overwrite --progress never --out " + out("again");
  ASSERT_EQ(run(overwrite + " --rig " + refined.string()).status, 0);
  EXPECT_TRUE(std::filesystem::exists(refined));
  ASSERT_EQ(run(overwrite).status, 0);
  EXPECT_FALSE(std::filesystem::exists(refined));
}

TEST_F(CommandLine, SavedMapsCanBeDescribedExportedAndContinued) {
  const auto saved = summary_of("saved", "--mode sequential --cameras 0,1 --save-map " + out("saved.map"));
  EXPECT_EQ(saved["map"]["loaded"], false);
  EXPECT_EQ(saved["maps_started"], 1);
  const Ran again = run("run " + data() + " --out " + out("unsaved") + " --save-map " + out("saved.map"));
  EXPECT_EQ(again.status, 2);
  EXPECT_NE(again.err.find("--overwrite"), std::string::npos) << again.err;
  ASSERT_EQ(saved["parts"].size(), 1u);
  EXPECT_EQ(saved["parts"][0]["trajectory"], "trajectory.tum");

  const Ran info = run("map info --json " + out("saved.map"));
  ASSERT_EQ(info.status, 0) << info.err;
  const auto described = nlohmann::json::parse(info.out);
  EXPECT_EQ(described["keyframes"], saved["map"]["keyframes"]);
  EXPECT_EQ(described["landmarks"], saved["map"]["landmarks"]);
  EXPECT_EQ(described["cameras"].size(), 2u);
  EXPECT_EQ(described["parts"].size(), 1u);
  EXPECT_NE(run("map info " + out("saved.map")).out.find("scale metric"), std::string::npos);

  ASSERT_EQ(run("map export " + out("saved.map") + " --out " + out("exported")).status, 0);
  for (const char* file : {"points.ply", "keyframes.tum", "rig.yaml", "cameras.txt", "images.txt", "points3D.txt"}) {
    EXPECT_GT(fs::file_size(folder_ / "exported" / file), 50u) << file;
  }
  const std::string named = "map export " + out("saved.map") + " --images " + data() + " --out " + out("named");
  ASSERT_EQ(run(named).status, 0);
  std::istringstream images(read_text(folder_ / "named/images.txt"));
  std::size_t existing = 0;
  for (std::string word; images >> word;) existing += word.ends_with(".png") && fs::exists(data() + "/" + word);
  EXPECT_GE(existing, 2u);
  const std::string poses = read_text(folder_ / "exported/keyframes.tum");
  EXPECT_EQ(std::count(poses.begin(), poses.end(), '\n'), 1 + described["keyframes"].get<int>());
  expect_rejected("map export " + out("saved.map") + " --out " + out("exported"));
  EXPECT_EQ(run("map export " + out("saved.map") + " --overwrite --out " + out("exported")).status, 0);
  for (const char* format : {"colmap", "ply", "g2o", "nerfstudio", "octomap", "nav2"}) {
    const std::string command = "map export " + out("saved.map") + " --format " + format + " --out " + out(format);
    const Ran exported = run(command);
    ASSERT_EQ(exported.status, 0) << exported.err;
    expect_rejected(command);  // it exists now
  }
  expect_rejected("map export " + out("saved.map") + " --format nav2 --height 1 0 --out " + out("wrong"));
  expect_rejected("map export " + out("saved.map") + " --format ply --undistort --out " + out("wrong"));
  expect_rejected("map export " + out("saved.map") + " --format colmap --submap 7 --out " + out("wrong"));

  const std::string path = "export " + out("saved") + "/trajectory.tum --rig " + data();
  ASSERT_EQ(run(path + " --format euroc --frame body --out " + out("body.csv")).status, 0);
  const Ran error = run("eval " + out("saved") + "/trajectory.tum " + out("body.csv") + " --gt-frame body --rig " +
                        data() + " --align none --json");
  ASSERT_EQ(error.status, 0) << error.err;
  EXPECT_LT(nlohmann::json::parse(error.out)["ate"]["max"], 1e-6);
  ASSERT_EQ(
      run(path + " --format kitti --frame cam1 --axes ros --map " + out("saved.map") + " --out " + out("k.txt")).status,
      0);
  expect_rejected(path + " --frame nobody --out " + out("wrong"));
  const std::string nav2 = "map export " + out("saved.map") + " --format nav2 --out ";
  const Ran tilted = run(nav2 + out("tilted")), level = run(nav2 + out("level") + " --up body:z");
  EXPECT_NE(tilted.err.find("note: upward is that of camera 0 on average"), std::string::npos) << tilted.err;
  EXPECT_EQ(level.status, 0) << level.err;
  EXPECT_EQ(level.err, "");
  expect_rejected("map export " + out("saved.map") + " --format ply --up body:z --out " + out("wrong"));
  expect_rejected(nav2 + out("wrong") + " --up sky");
  expect_rejected(path + " --up body:z --out " + out("wrong"));
  ASSERT_EQ(run(path + " --axes ros --up body:z --out " + out("upright.tum")).status, 0);
  EXPECT_NE(read_text(out("upright.tum")).find("frame=cam0_ros parent=world_ros "), std::string::npos);
  expect_rejected("export " + out("upright.tum") + " --out " + out("wrong"));
  expect_rejected("export " + out("saved") + "/trajectory.tum --frame body --out " + out("wrong"));

  const auto localised = summary_of("localised", "--cameras 0,1 --localize-only --load-map " + out("saved.map"));
  EXPECT_EQ(localised["map"]["loaded"], true);
  EXPECT_EQ(localised["frames"]["tracked"], 15);
  EXPECT_EQ(localised["map"]["keyframes"], saved["map"]["keyframes"]);
  EXPECT_EQ(localised["maps_started"], 0);
  ASSERT_EQ(localised["relocalisations"].size(), 1u);
  EXPECT_EQ(localised["relocalisations"][0]["at"], 0.0);
  const auto grown =
      summary_of("grown", "--cameras 0,1 --load-map " + out("saved.map") + " --save-map " + out("grown.map"));
  EXPECT_EQ(grown["frames"]["tracked"], 15);
  EXPECT_EQ(run("map info " + out("grown.map")).status, 0);
  const auto one_camera = summary_of("one_camera", "--cameras 0 --localize-only --load-map " + out("saved.map"));
  EXPECT_EQ(one_camera["frames"]["tracked"], 15);
  run("run " + data() + " --out " + out("second_rig") + " --cameras 2,3 --end 0.5 --load-map " + out("saved.map"));
  EXPECT_NE(read_text(out("second_rig") + "/config.yaml").find("\n  refine: false"), std::string::npos);
  expect_rejected("run " + data() + " --out " + out("rejected") +
                  " --cameras 2,3 --set calibration.refine=true --load-map " + out("saved.map"));
}

// A trajectory names the camera whose poses it contains, and conversions use that.
TEST_F(CommandLine, TrajectoriesOfOtherCamerasSayWhichOne) {
  summary_of("second", "--cameras 1,0 --mode sequential");
  const std::string trajectory = out("second") + "/trajectory.tum", truth = data() + "/groundtruth_cam0.tum";
  const camera::Rig rig = rig_formats::read_rig(data() + "/rig.yaml").value();
  EXPECT_NE(
      read_text(trajectory).find("# bslam trajectory frame=" + rig.camera(1u).name + " parent=world final=true\n"),
      std::string::npos);
  const Ran without = run("eval " + trajectory + " " + truth + " --json");
  EXPECT_NE(without.err.find("contains poses of " + rig.camera(1u).name), std::string::npos) << without.err;
  const Ran with = run("eval " + trajectory + " " + truth + " --json --rig " + data());
  EXPECT_EQ(with.err, "");
  ASSERT_EQ(run("export " + trajectory + " --frame cam0 --rig " + data() + " --out " + out("cam0.tum")).status, 0);
  const Ran exported = run("eval " + out("cam0.tum") + " " + truth + " --json");
  const auto error_of = [](const Ran& ran) -> double { return nlohmann::json::parse(ran.out)["ate"]["rmse"]; };
  EXPECT_NEAR(error_of(with), error_of(exported), 1e-6);
  EXPECT_GT(std::abs(error_of(with) - error_of(without)), 1e-5);
  const std::string body = "export " + trajectory + " --frame body --rig " + data() + " --out ";
  ASSERT_EQ(run(body + out("body.tum")).status, 0);
  const Ran same =
      run("eval " + trajectory + " " + out("body.tum") + " --gt-frame body --rig " + data() + " --align none --json");
  EXPECT_LT(nlohmann::json::parse(same.out)["ate"]["max"], 1e-6) << same.err;
  const Ran other = run(body + out("other.tum") + " --camera 0");
  EXPECT_NE(other.err.find("but --camera 0 is "), std::string::npos) << other.err;
  support::write_text(out("scaled.tum"),
                      "# bslam trajectory frame=cam0 parent=world final=true\n"
                      "# scale=up-to-scale: lengths are not in metres\n" +
                          read_text(truth));
  const Ran scaled = run("eval " + out("scaled.tum") + " " + truth);
  EXPECT_NE(scaled.err.find("use --align sim3"), std::string::npos) << scaled.err;
  EXPECT_EQ(run("eval " + out("scaled.tum") + " " + truth + " --align sim3").err, "");
  // The distance from camera to body has no meaning in the unit of the estimate, so that the ground truth is moved.
  ASSERT_EQ(run("export " + truth + " --frame body --rig " + data() + " --out " + out("true_body.tum")).status, 0);
  evaluation::Trajectory quarter = evaluation::read_trajectory(truth).value();
  for (evaluation::TimedPose& pose : quarter)
    pose.T_world_frame = {pose.T_world_frame.rotation(), 0.25 * pose.T_world_frame.translation()};
  support::write_text(
      out("quarter.tum"),
      evaluation::tum_text(
          quarter,
          "# bslam trajectory frame=cam0 parent=world final=true\n# scale=up-to-scale: lengths are not in metres"));
  const Ran of_body = run("eval " + out("quarter.tum") + " " + out("true_body.tum") +
                          " --gt-frame body --align sim3 --json --rig " + data());
  EXPECT_NE(of_body.err.find("the ground truth was moved by 0."), std::string::npos) << of_body.err;
  EXPECT_LT(nlohmann::json::parse(of_body.out)["ate"]["max"], 1e-6) << of_body.out;
  EXPECT_NEAR(nlohmann::json::parse(of_body.out)["scale"], 4, 1e-6) << of_body.out;
  const std::string rig_and_out = " --rig " + data() + " --overwrite --out " + out("exported.tum");
  EXPECT_NE(run("export " + out("scaled.tum") + " --frame body" + rig_and_out).err.find("is not the metre"),
            std::string::npos);
  EXPECT_NE(read_text(out("exported.tum")).find("\n# scale=up-to-scale: lengths are not in metres\n"),
            std::string::npos);
  ASSERT_EQ(run("export " + truth + " --camera 1 --frame cam0" + rig_and_out).status, 0);
  const Ran moved = run("eval " + out("exported.tum") + " " + truth + " --align none --json");
  EXPECT_GT(nlohmann::json::parse(moved.out)["ate"]["max"], 1e-3) << moved.err;
}

// The stamps of the input are converted only if they are others, and its comments are kept.
TEST_F(CommandLine, AnExportKnowsTheStampsAndTheWorldOfItsInput) {
  const std::string rig = out("stamped.yaml"), input = out("stamped.tum"), exported = out("stamps.tum");
  ASSERT_EQ(run("rig convert " + data() + " " + rig).status, 0);
  std::string text = read_text(rig);
  const std::string key = "time_offset_s: 0.0";
  ASSERT_NE(text.find(key), std::string::npos);
  support::write_text(rig, text.replace(text.find(key), key.size(), "time_offset_s: 0.25"));
  const std::string header = "# bslam trajectory frame=cam0 parent=world_of_submap_2 final=false\n";
  const std::string stamps = "# time stamps are those of the images, without the time offset of camera 0\n";
  const std::string pose = " 1.000000000 2.000000000 3.000000000 0.000000000 0.000000000 0.000000000 1.000000000\n";
  const std::string command = "export " + input + " --rig " + rig + " --overwrite --out " + exported;
  for (const auto& [comments, seconds, option, written] :
       {std::tuple(header + stamps, "5.000000000", " --stamps image", header + stamps + "5.000000000" + pose),
        std::tuple(header + stamps, "5.000000000", "", header + stamps + "5.000000000" + pose),
        std::tuple(header + stamps, "5.000000000", " --stamps capture", header + "5.250000000" + pose),
        std::tuple(header, "5.250000000", " --stamps image", header + stamps + "5.000000000" + pose),
        std::tuple(header, "5.250000000", " --stamps capture", header + "5.250000000" + pose)}) {
    support::write_text(input, comments + seconds + pose);
    const Ran ran = run(command + option);
    EXPECT_EQ(ran.status, 0) << option << ": " << ran.err;
    EXPECT_EQ(read_text(exported), written) << option;
  }
  EXPECT_EQ(run(command + " --axes ros").status, 0);
  EXPECT_NE(read_text(exported).find(" frame=cam0_ros parent=world_of_submap_2_ros final=false\n"), std::string::npos);
}

TEST_F(CommandLine, AJournalReplaysItsRun) {
  EXPECT_EQ(summary_of("recorded", "--cameras 0,1 --mode parallel --journal " + out("run.journal"))["mode"],
            "parallel");
  EXPECT_EQ(summary_of("replayed", "--cameras 0,1 --mode parallel --replay " + out("run.journal"))["mode"], "replay");
  expect_same_trajectories("recorded", "replayed");
  expect_rejected("run " + data() + " --out " + out("other") +
                  " --cameras 0,1 --set features.per_image=500 --end 0.25 --progress never --replay " +
                  out("run.journal"));
}

TEST_F(CommandLine, LaggedRunsAreDeterministic) {
  EXPECT_EQ(summary_of("lagged", "--mode lagged --set execution.threads=1")["mode"], "lagged");
  EXPECT_EQ(summary_of("lagged_again", "--mode lagged --set execution.threads=3")["mode"], "lagged");
  expect_same_trajectories("lagged", "lagged_again");
}

TEST_F(CommandLine, ARunWarnsAboutAWrongCalibration) {
  const camera::Rig rig = rig_formats::read_rig(data() + "/rig.yaml").value();
  ASSERT_TRUE(rig_formats::write_rig(calibration::with_inverse_extrinsics(rig), out("inverse.yaml")));
  const std::string options = " --set features.per_image=500 --progress never --rig ";
  const std::string map = out("inverse.bmap"), found = "the images do not belong to the calibration";
  const Ran inverse =
      run("run " + data() + options + out("inverse.yaml") + " --out " + out("inverse") + " --save-map " + map);
  EXPECT_NE(inverse.err.find("warning: the images do not belong to the calibration"), std::string::npos) << inverse.err;
  EXPECT_NE(inverse.out.find("calibration: the images do not belong to it"), std::string::npos) << inverse.out;
  const auto of_inverse = nlohmann::json::parse(read_text(out("inverse") + "/summary.json"));
  EXPECT_EQ(of_inverse["calibration"]["verdict"], "inconsistent");
  EXPECT_EQ(of_inverse["calibration"]["refined"], false);
  EXPECT_EQ(of_inverse["map"]["scale"], "unobservable");
  EXPECT_FALSE(fs::exists(out("inverse") + "/rig_refined.yaml"));
  EXPECT_NE(run("map info " + map).out.find("warning of the run that made it: " + found), std::string::npos);
  const Ran continued = run("run " + data() + options + out("inverse.yaml") + " --end 0.5 --localize-only --load-map " +
                            map + " --out " + out("inverse_again"));
  EXPECT_NE(continued.err.find("inverse.bmap: the run that made this map has found: " + found), std::string::npos)
      << continued.err;
  for (const auto& warning : of_inverse["warnings"])
    EXPECT_NE(inverse.err.find("warning: " + warning.get<std::string>() + "\n"), std::string::npos) << warning;
  EXPECT_EQ(of_inverse["warnings"].size(),
            static_cast<std::size_t>(std::count(inverse.err.begin(), inverse.err.end(), '\n')));
  std::vector<camera::RigCamera> cameras;
  for (std::size_t c = 0; c < rig.size(); ++c) {
    const geometry::SE3& T = rig.body_from_cam(c);
    cameras.push_back({rig.camera(c), geometry::SE3(T.rotation(), 1000 * T.translation())});
  }
  ASSERT_TRUE(rig_formats::write_rig(camera::Rig(cameras), out("millimetres.yaml")));
  const Ran large = run("run " + data() + options + out("millimetres.yaml") + " --out " + out("millimetres"));
  EXPECT_NE(large.err.find("are they millimetres?"), std::string::npos) << large.err;
  const camera::Rig upside_down = [&] {
    std::vector<camera::RigCamera> rotated;
    for (std::size_t c = 0; c < rig.size(); ++c) rotated.push_back({rig.camera(c), rig.body_from_cam(c)});
    rotated[3].T_body_cam = rotated[3].T_body_cam * geometry::SE3(Eigen::Quaterniond(0, 0, 0, 1), {0, 0, 0});
    return camera::Rig(rotated);
  }();
  ASSERT_TRUE(rig_formats::write_rig(upside_down, out("upside_down.yaml")));
  const Ran ran =
      run("run " + data() + options + out("upside_down.yaml") + " --mode sequential --out " + out("upside_down"));
  EXPECT_NE(ran.err.find("keypoints are where the map predicts them"), std::string::npos) << ran.err;
  EXPECT_NE(ran.err.find("bslam rig info " + out("upside_down.yaml") + " --images " + data()), std::string::npos)
      << ran.err;
  const Ran right = run("run " + data() + options + data() + "/rig.yaml --out " + out("right"));
  EXPECT_EQ(right.err, "");
  const auto of_right = nlohmann::json::parse(read_text(out("right") + "/summary.json"));
  EXPECT_EQ(of_right["map"]["scale"], "metric");
  EXPECT_TRUE(of_right["warnings"].empty());
  EXPECT_TRUE(of_right["calibration"]["pairs"].empty());
}

TEST_F(CommandLine, BenchReportsEverySequenceAndFailsIfOneFailed) {
  const fs::path root = folder_ / "sequences";
  fs::create_directories(root / "broken/mav0/cam0");
  fs::create_directory_symlink(data(), root / "tour");
  const std::string notes = out("bench") + "/tour/run1/notes.txt";
  support::write_text(notes, "of the user");
  const Ran ran = run("bench " + root.string() + " --runs 5 --overwrite --out " + out("bench") +
                      " --mode sequential --cameras 0,1 --set features.per_image=500");
  EXPECT_EQ(ran.status, 2) << ran.err;
  const std::string report = read_text(out("bench") + "/report.md");
  EXPECT_EQ(ran.out, report);
  EXPECT_NE(report.find("| broken | none: no errors | 5 | - | - | - | - | - / - | - | 5 of 5 runs failed: "),
            std::string::npos)
      << report;
  EXPECT_NE(report.find("| tour | body | 2 | 0.0"), std::string::npos) << report;
  EXPECT_NE(report.find("| 15 of 15 |"), std::string::npos) << report;
  EXPECT_NE(report.find("deterministic: the first two runs are identical"), std::string::npos) << report;
  EXPECT_FALSE(fs::exists(out("bench") + "/tour/run3"));
  EXPECT_NE(read_text(out("bench") + "/report.html").find("<td>tour</td>"), std::string::npos);
  EXPECT_TRUE(fs::exists(out("bench") + "/tour/run2/trajectory.tum"));
  EXPECT_TRUE(fs::exists(notes));
}

TEST_F(CommandLine, BenchRejectsAFolderWithoutSequences) {
  const fs::path empty = folder_ / "empty";
  fs::create_directories(empty);
  const Ran ran = run("bench " + empty.string() + " --out " + out("rejected"));
  EXPECT_EQ(ran.status, 2);
  EXPECT_NE(ran.err.find("found no sequence"), std::string::npos) << ran.err;
}

TEST_F(CommandLine, AnInterruptedBenchKeepsTheTableSoFar) {
  const std::string folder = out("bench_interrupted"), log = folder + "/data/run2/log.txt";
  EXPECT_EQ(interrupted("bench " + data() + " --out " + folder + " --runs 1000 --pace realtime",
                        [&] { return fs::exists(log); }),
            130)
      << read_text(out("stderr"));
  const std::string report = read_text(folder + "/report.md");
  EXPECT_NE(report.find("Not complete"), std::string::npos) << report;
  EXPECT_NE(report.find("| data | 1 | "), std::string::npos) << report;
}

TEST_F(CommandLine, AnInterruptedRunWritesItsResultsAndReportsIt) {
  const std::string folder = out("interrupted");
  // The output folder is created before the first frame; at the recorded pace the run then takes 1.5 s.
  EXPECT_EQ(interrupted("run " + data() + " --out " + folder + " --pace realtime --progress never",
                        [&] { return fs::exists(folder); }),
            130)
      << read_text(out("stderr"));
  EXPECT_EQ(nlohmann::json::parse(read_text(folder + "/summary.json"))["complete"], false);
}

// A limit of the sizes of files stands for a full disk: trajectories fit, the map does not.
TEST_F(CommandLine, ARunWhoseMapCannotBeWrittenStillPrintsItsResult) {
  const std::string script = out("full.sh");
  support::write_text(script, "trap '' XFSZ\nulimit -f 1500\nexec \"$@\"\n");
  const std::string command = "sh " + script + " " + BSLAM_PROGRAM + " run " + data() + " --out " + out("full") +
                              " --no-report --progress never --log-level error --save-map " + out("full.map") + " >" +
                              out("stdout") + " 2>" + out("stderr");
  const int status = std::system(command.c_str());
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_NE(WEXITSTATUS(status), 0);
  const std::string printed = read_text(out("stdout")), errors = read_text(out("stderr"));
  EXPECT_NE(printed.find("of 15 frames have a pose"), std::string::npos) << printed << errors;
  EXPECT_NE(errors.find("full.map"), std::string::npos) << errors;
  EXPECT_EQ(std::count(errors.begin(), errors.end(), '\n'), 1) << errors;
  EXPECT_TRUE(fs::exists(out("full/trajectory.tum")));
  EXPECT_FALSE(fs::exists(out("full.map")));
}

TEST_F(CommandLine, EvalSaysWhatItCannotKnowOrWrite) {
  const std::string truth = data() + "/groundtruth_cam0.tum", both = "eval " + truth + " " + truth;
  const Ran plot = run(both + " --plot " + out("plot.png"));
  EXPECT_EQ(plot.status, 2);
  EXPECT_NE(plot.err.find("plot.png, expected a name that ends in .svg"), std::string::npos) << plot.err;
  EXPECT_FALSE(fs::exists(out("plot.png")));
  EXPECT_EQ(run(both + " --plot " + out("plot.svg")).status, 0);
  support::write_text(out("bodiless.yaml"),
                      "cam0:\n  camera_model: pinhole\n  intrinsics: [50, 50, 30, 10]\n  distortion_model: none\n"
                      "  distortion_coeffs: []\n  resolution: [60, 20]\n");
  const Ran body = run(both + " --gt-frame body --rig " + out("bodiless.yaml"));
  EXPECT_EQ(body.status, 0) << body.err;
  EXPECT_NE(body.err.find("the body is taken to be camera 0\n"), std::string::npos) << body.err;
}

}  // namespace
}  // namespace bslam
