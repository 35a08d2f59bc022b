// The command-line program: exit status, one-line errors, and files that are written completely or not at all.
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

#include "calibration/rig_warnings.h"
#include "evaluation/trajectory_file.h"
#include "rig_formats/rig_file.h"
#include "simulator/simulation_writer.h"
#include "synthetic/rigs.h"

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
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, slurp(out("stdout")), slurp(out("stderr"))};
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
    return nlohmann::json::parse(slurp(out(name) + "/summary.json"), nullptr, false);
  }

  static void expect_same_trajectories(const std::string& a, const std::string& b) {
    for (const char* file : {"/trajectory.tum", "/trajectory_live.tum"}) {
      EXPECT_GT(slurp(out(a) + file).size(), 1000u);
      EXPECT_EQ(slurp(out(a) + file), slurp(out(b) + file)) << file;
    }
  }

  static inline fs::path folder_;
};

TEST_F(CommandLine, PrintsVersionAndHelpForEveryCommand) {
  EXPECT_EQ(run("--version").status, 0);
  EXPECT_NE(run("--version").out.find("Eigen"), std::string::npos);
  for (const char* verb :
       {"",          "run",          "live",        "eval",          "bench",      "simulate",    "inspect",
        "rig",       "rig info",     "rig convert", "rig calibrate", "map",        "map info",    "map export",
        "map merge", "map transfer", "export",      "vocab",         "vocab info", "vocab train", "settings"}) {
    EXPECT_EQ(run(std::string(verb) + " --help").status, 0) << verb;
  }
}

TEST_F(CommandLine, SuggestsCorrectionsOfMisspelledWords) {
  const std::string base = "run " + data() + " --out " + out("rejected");
  const std::pair<std::string, std::string> cases[] = {
      {"rum " + data(), "bslam: unknown command 'rum'; did you mean 'run'?\n"},
      {"rum " + data() + " --out x", "unknown command 'rum'; did you mean 'run'?"},
      {data() + " --out x", "; see bslam --help"},
      {"--seed 3 " + base, "option '--seed' must follow the command"},
      {"map info", "FILE is required (see bslam map info --help)"},
      {"rig infoo x", "unknown command 'infoo'; did you mean 'info'?"},
      {base + " --mdoe lagged", "unknown option '--mdoe'; did you mean '--mode'?"},
      {"run " + data() + " --ouT=x", "unknown option '--ouT'; did you mean '--out'?"},
      {base + " --mode sideways", "--mode: found sideways, expected one of: sequential, lagged, parallel"},
      {base + " --set features.per_imge=1", "unknown setting 'features.per_imge'; did you mean 'features.per_image'?"},
      {base + " --set nfeatures=1", "unknown setting 'nfeatures'; 'bslam settings --common' lists"},
      {base + " --config /no/such", "bslam: cannot open /no/such: No such file or directory\n"},
      {base + " --seed -1", "--seed: Value -1 not in range 0 to 2147483647"},
      {"run", "DATA is required (see bslam run --help)\n"}};
  for (const auto& [arguments, message] : cases) {
    const Ran ran = run(arguments);
    EXPECT_EQ(ran.status, 2) << arguments;
    EXPECT_NE(ran.err.find(message), std::string::npos) << arguments << ": " << ran.err;
  }
}

TEST_F(CommandLine, PrintedSettingsCanBeRead) {
  const Ran all = run("settings --set features.levels=5");
  EXPECT_EQ(all.status, 0);
  EXPECT_NE(all.out.find("levels: 5"), std::string::npos);
  std::ofstream(out("settings.yaml")) << all.out;
  EXPECT_EQ(run("settings --config " + out("settings.yaml")).out, all.out);
}

TEST_F(CommandLine, PrintsOnlyTheCommonSettings) {
  const std::string common = run("settings --common").out;
  EXPECT_NE(common.find("per_image: "), std::string::npos);
  EXPECT_EQ(common.find("[advanced]"), std::string::npos);
  EXPECT_LT(common.size(), run("settings").out.size() / 3);
}

TEST_F(CommandLine, TheLogLevelSelectsTheMessages) {
  const std::string command = "run " + data() + " --end 0.3 --overwrite --progress never --out " + out("logged");
  EXPECT_EQ(run(command).err.find("info: "), std::string::npos);
  const Ran info = run(command + " --log-level info");
  EXPECT_NE(info.err.find("info: stage extract: "), std::string::npos) << info.err;
  EXPECT_EQ(info.err.find("debug: "), std::string::npos);
  EXPECT_NE(run(command + " --log-level debug").err.find("debug: frame 0 at 0.000 s: "), std::string::npos);
  EXPECT_EQ(run(command + " --log-level error").err, "");
}

TEST_F(CommandLine, RejectsInvalidArguments) {
  const std::string base = "run " + data() + " --out " + out("rejected") + " --progress never ";
  for (const char* more : {"--set no.such.key=1",
                           "--set features.per_image=-5",
                           "--set features.per_image=many",
                           "--set seed",
                           "--cameras 0,9",
                           "--cameras 0,0",
                           "--cameras a",
                           "--cameras 0,",
                           "--cameras ''",
                           "--mode sideways",
                           "--begin 5 --end 1",
                           "--begin 99",
                           "--format bag",
                           "--pace slow",
                           "--seed -1",
                           "--config /no/such/file",
                           "--rig /no/such/file",
                           "--bogus",
                           "--localize-only",
                           "--load-map /no/such/file",
                           "--vocabulary /no/such/file",
                           "--replay /no/such/file",
                           "--no-final-ba --set calibration.refine=true"}) {
    expect_rejected(base + more);
  }
  expect_rejected("run /no/such/folder --out " + out("rejected"));
  expect_rejected("run " + data());
  expect_rejected("frobnicate");
  expect_rejected("");
  expect_rejected("eval /no/such/file " + data() + "/groundtruth_cam0.tum");
  expect_rejected("inspect " + data() + " --frame 999 --out " + out("frame.json"));
  expect_rejected("rig info /no/such/file");
  expect_rejected("map info /no/such/file");
  expect_rejected("map info " + data() + "/groundtruth_cam0.tum");
  expect_rejected("map export /no/such/file --out " + out("rejected"));
  expect_rejected("vocab info " + data() + "/groundtruth_cam0.tum");
  expect_rejected("vocab train /no/such/folder --out " + out("never.bvoc"));
  expect_rejected("simulate --out " + out("never") + " --duration -1");
}

TEST_F(CommandLine, RunWritesItsFilesAndIsRepeatableFromItsConfiguration) {
  const Ran first = run("run " + data() + " --out " + out("first") +
                        " --mode sequential --progress never --set features.per_image=700");
  ASSERT_EQ(first.status, 0) << first.err;
  for (const char* file : {"trajectory.tum", "trajectory_live.tum", "summary.json", "config.yaml", "trajectory.svg",
                           "run.svg", "report.html"}) {
    EXPECT_TRUE(fs::exists(folder_ / "first" / file)) << file;
  }
  const auto summary = nlohmann::json::parse(slurp(folder_ / "first/summary.json"));
  EXPECT_EQ(summary["schema"], 1);
  EXPECT_EQ(summary["complete"], true);
  EXPECT_EQ(summary["frames"]["input"], 15);
  EXPECT_EQ(summary["frames"]["tracked"], 15);
  EXPECT_EQ(summary["map"]["scale"], "metric");
  EXPECT_NE(slurp(folder_ / "first/trajectory.tum").find("# bslam trajectory frame=cam0 parent=world final=true\n"),
            std::string::npos);

  const Ran again =
      run("run " + data() + " --out " + out("again") + " --progress never --config " + out("first/config.yaml"));
  ASSERT_EQ(again.status, 0) << again.err;
  EXPECT_EQ(slurp(folder_ / "first/trajectory.tum"), slurp(folder_ / "again/trajectory.tum"));
  EXPECT_NE(slurp(folder_ / "first/report.html").find("--set features.per_image=700"), std::string::npos);
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
  std::istringstream images(slurp(folder_ / "named/images.txt"));
  std::size_t existing = 0;
  for (std::string word; images >> word;) existing += word.ends_with(".png") && fs::exists(data() + "/" + word);
  EXPECT_GE(existing, 2u);
  const std::string poses = slurp(folder_ / "exported/keyframes.tum");
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
  EXPECT_NE(slurp(out("upright.tum")).find("frame=cam0_ros parent=world_ros "), std::string::npos);
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
  EXPECT_NE(slurp(out("second_rig") + "/config.yaml").find("\n  refine: false"), std::string::npos);
  expect_rejected("run " + data() + " --out " + out("rejected") +
                  " --cameras 2,3 --set calibration.refine=true --load-map " + out("saved.map"));
}

// A trajectory names the camera whose poses it contains, and conversions use that.
TEST_F(CommandLine, TrajectoriesOfOtherCamerasSayWhichOne) {
  summary_of("second", "--cameras 1,0 --mode sequential");
  const std::string trajectory = out("second") + "/trajectory.tum", truth = data() + "/groundtruth_cam0.tum";
  const camera::Rig rig = rig_formats::read_rig(data() + "/rig.yaml").value();
  EXPECT_NE(slurp(trajectory).find("# bslam trajectory frame=" + rig.camera(1u).name + " parent=world final=true\n"),
            std::string::npos);
  const Ran without = run("eval " + trajectory + " " + truth + " --json");
  EXPECT_NE(without.err.find("contains poses of " + rig.camera(1u).name), std::string::npos) << without.err;
  const Ran with = run("eval " + trajectory + " " + truth + " --json --rig " + data());
  EXPECT_EQ(with.err, "");
  EXPECT_LT(nlohmann::json::parse(with.out)["ate"]["rmse"], nlohmann::json::parse(without.out)["ate"]["rmse"]);
  const std::string body = "export " + trajectory + " --frame body --rig " + data() + " --out ";
  ASSERT_EQ(run(body + out("body.tum")).status, 0);
  const Ran same =
      run("eval " + trajectory + " " + out("body.tum") + " --gt-frame body --rig " + data() + " --align none --json");
  EXPECT_LT(nlohmann::json::parse(same.out)["ate"]["max"], 1e-6) << same.err;
  const Ran other = run(body + out("other.tum") + " --camera 0");
  EXPECT_NE(other.err.find("but --camera 0 is "), std::string::npos) << other.err;
  std::ofstream(out("scaled.tum")) << "# bslam trajectory frame=cam0 parent=world final=true\n"
                                   << "# scale=up-to-scale: lengths are not in metres\n"
                                   << slurp(truth);
  const Ran scaled = run("eval " + out("scaled.tum") + " " + truth);
  EXPECT_NE(scaled.err.find("use --align sim3"), std::string::npos) << scaled.err;
  EXPECT_EQ(run("eval " + out("scaled.tum") + " " + truth + " --align sim3").err, "");
  // The distance from camera to body has no meaning in the unit of the estimate, so that the ground truth is moved.
  ASSERT_EQ(run("export " + truth + " --frame body --rig " + data() + " --out " + out("true_body.tum")).status, 0);
  evaluation::Trajectory quarter = evaluation::read_trajectory(truth).value();
  for (evaluation::TimedPose& pose : quarter)
    pose.T_world_frame = {pose.T_world_frame.rotation(), 0.25 * pose.T_world_frame.translation()};
  std::ofstream(out("quarter.tum")) << evaluation::tum_text(
      quarter, "# bslam trajectory frame=cam0 parent=world final=true\n# scale=up-to-scale: lengths are not in metres");
  const Ran of_body = run("eval " + out("quarter.tum") + " " + out("true_body.tum") +
                          " --gt-frame body --align sim3 --json --rig " + data());
  EXPECT_NE(of_body.err.find("the ground truth was moved by 0."), std::string::npos) << of_body.err;
  EXPECT_LT(nlohmann::json::parse(of_body.out)["ate"]["max"], 1e-6) << of_body.out;
  EXPECT_NEAR(nlohmann::json::parse(of_body.out)["scale"], 4, 1e-6) << of_body.out;
  const std::string rig_and_out = " --rig " + data() + " --overwrite --out " + out("exported.tum");
  EXPECT_NE(run("export " + out("scaled.tum") + " --frame body" + rig_and_out).err.find("is not the metre"),
            std::string::npos);
  EXPECT_NE(slurp(out("exported.tum")).find("\n# scale=up-to-scale: lengths are not in metres\n"), std::string::npos);
  ASSERT_EQ(run("export " + truth + " --camera 1 --frame cam0" + rig_and_out).status, 0);
  const Ran moved = run("eval " + out("exported.tum") + " " + truth + " --align none --json");
  EXPECT_GT(nlohmann::json::parse(moved.out)["ate"]["max"], 1e-3) << moved.err;
}

TEST_F(CommandLine, ExplainsAPortAfterViewAndARigOfAnotherResolution) {
  const Ran port = run("run " + data() + " --out " + out("rejected") + " --view 9000");
  EXPECT_EQ(port.status, 2);
  EXPECT_EQ(port.err, "bslam: unexpected '9000'; did you mean '--view=9000'?\n");
  ASSERT_TRUE(rig_formats::write_rig(synthetic::ring_rig(4, 240), out("other_size.yaml")));
  const Ran info = run("data info " + data() + " --rig " + out("other_size.yaml"));
  EXPECT_NE(info.out.find("missing for bslam run: the calibration of 376 x 240 pixels"), std::string::npos) << info.out;
  EXPECT_EQ(run("data info " + data() + " --rig " + data() + "/rig.yaml").out.find("missing"), std::string::npos);
}

// An interpreter that finds the packages, but no viewer, and fails after the run with a coloured message.
TEST_F(CommandLine, TheTargetOfRerunIsCheckedBeforeTheRun) {
  const std::string interpreter = out("python"), file = out("run.rrd");
  std::ofstream(interpreter) << "#!/bin/sh\ncase \"$2\" in\n*is_reachable*) exit 3 ;;\n"
                             << "*main*) printf 'log\\n\\033[1;31mError\\033[0m: no room\\n'; exit 2 ;;\nesac\n";
  fs::permissions(interpreter, fs::perms::owner_all);
  ::setenv("BSLAM_PYTHON", interpreter.c_str(), 1);
  std::ofstream(file) << "precious";
  const std::string base = "run " + data() + " --end 0.3 --set features.per_image=300 --progress never --out ";
  for (const auto& [target, message] :
       {std::pair(file, "run.rrd: --rerun: found an existing file"),
        std::pair(out("none/a.rrd"), "--rerun: found no such folder"),
        std::pair(std::string("rerun+http://127.0.0.1:9/proxy"), "found no viewer at")}) {
    expect_rejected(base + out("rejected") + " --rerun " + target);
    EXPECT_NE(run(base + out("rejected") + " --rerun " + target).err.find(message), std::string::npos) << target;
  }
  EXPECT_EQ(slurp(file), "precious");
  const Ran failed = run(base + out("shown") + " --overwrite --rerun " + file);
  ::unsetenv("BSLAM_PYTHON");
  EXPECT_EQ(failed.status, 2);
  EXPECT_NE(failed.err.find("found Error: no room, expected a file or a viewer"), std::string::npos) << failed.err;
  EXPECT_TRUE(fs::exists(out("shown/trajectory.tum")));
}

TEST_F(CommandLine, VocabulariesCanBeTrainedDescribedAndUsed) {
  EXPECT_NE(run("vocab info").out.find("orb256-bslam"), std::string::npos);
  const std::string train = "vocab train " + data() + "/mav0/cam0/data " + data() +
                            "/mav0/cam2/data --branching 6 --levels 3 --features 300 --progress never ";
  ASSERT_EQ(run(train + "--threads 1 --out " + out("one.bvoc")).status, 0);
  ASSERT_EQ(run(train + "--threads 2 --out " + out("two.bvoc")).status, 0);
  EXPECT_EQ(slurp(out("one.bvoc")), slurp(out("two.bvoc")));
  expect_rejected(train + "--out " + out("one.bvoc"));  // exists already, and --overwrite is not given
  const Ran info = run("vocab info " + out("one.bvoc"));
  EXPECT_NE(info.out.find("branching    6\nlevels       3\nwords        216\n"), std::string::npos) << info.out;

  summary_of("worded", "--cameras 0,1 --vocabulary " + out("one.bvoc") + " --save-map " + out("worded.map"));
  expect_rejected("run " + data() + " --out " + out("rejected") + " --cameras 0,1 --load-map " +
                  out("worded.map"));  // another vocabulary
  const std::string same =
      "--cameras 0,1 --vocabulary " + out("one.bvoc") + " --localize-only --load-map " + out("worded.map");
  EXPECT_EQ(summary_of("worded_again", same)["frames"]["tracked"], 15);
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

TEST_F(CommandLine, SimulateWritesAUsableRecording) {
  const Ran made = run("simulate --out " + out("simulated") + " --duration 0.5 --rate 10 --progress never");
  ASSERT_EQ(made.status, 0) << made.err;
  const Ran ran = run("run " + out("simulated") + " --out " + out("of_simulated") + " --progress never");
  ASSERT_EQ(ran.status, 0) << ran.err;
  EXPECT_EQ(nlohmann::json::parse(slurp(out("of_simulated") + "/summary.json"))["frames"]["tracked"], 5);
}

TEST_F(CommandLine, InspectWritesAConsistentBundledTable) {
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

TEST_F(CommandLine, ARunWarnsAboutAWrongCalibration) {
  const camera::Rig rig = rig_formats::read_rig(data() + "/rig.yaml").value();
  ASSERT_TRUE(rig_formats::write_rig(calibration::with_inverse_extrinsics(rig), out("inverse.yaml")));
  const std::string options = " --set features.per_image=500 --progress never --rig ";
  const std::string map = out("inverse.bmap"), found = "the images do not belong to the calibration";
  const Ran inverse =
      run("run " + data() + options + out("inverse.yaml") + " --out " + out("inverse") + " --save-map " + map);
  EXPECT_NE(inverse.err.find("warning: the images do not belong to the calibration"), std::string::npos) << inverse.err;
  EXPECT_NE(inverse.out.find("calibration: the images do not belong to it"), std::string::npos) << inverse.out;
  const auto of_inverse = nlohmann::json::parse(slurp(out("inverse") + "/summary.json"));
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
  EXPECT_NE(ran.err.find("keypoints are inliers: check this camera's extrinsics"), std::string::npos) << ran.err;
  EXPECT_NE(ran.err.find("bslam rig info " + out("upside_down.yaml") + " --images " + data()), std::string::npos)
      << ran.err;
  const Ran right = run("run " + data() + options + data() + "/rig.yaml --out " + out("right"));
  EXPECT_EQ(right.err, "");
  const auto of_right = nlohmann::json::parse(slurp(out("right") + "/summary.json"));
  EXPECT_EQ(of_right["map"]["scale"], "metric");
  EXPECT_TRUE(of_right["warnings"].empty());
  EXPECT_TRUE(of_right["calibration"]["pairs"].empty());
}

TEST_F(CommandLine, BenchReportsEverySequenceAndFailsIfOneFailed) {
  const fs::path root = folder_ / "sequences";
  fs::create_directories(root / "broken/mav0/cam0");
  fs::create_directory_symlink(data(), root / "tour");
  const Ran ran = run("bench " + root.string() + " --runs 5 --out " + out("bench") +
                      " --mode sequential --cameras 0,1 --set features.per_image=500");
  EXPECT_EQ(ran.status, 2) << ran.err;
  const std::string report = slurp(out("bench") + "/report.md");
  EXPECT_EQ(ran.out, report);
  EXPECT_NE(report.find("| broken | none: no errors | 5 | - | - | - | - | - / - | - | 5 of 5 runs failed: "),
            std::string::npos)
      << report;
  EXPECT_NE(report.find("| tour | body | 2 | 0.0"), std::string::npos) << report;
  EXPECT_NE(report.find("| 15 of 15 |"), std::string::npos) << report;
  EXPECT_NE(report.find("deterministic: the first two runs are identical"), std::string::npos) << report;
  EXPECT_FALSE(fs::exists(out("bench") + "/tour/run3"));
  EXPECT_NE(slurp(out("bench") + "/report.html").find("<td>tour</td>"), std::string::npos);
  EXPECT_TRUE(fs::exists(out("bench") + "/tour/run2/trajectory.tum"));
}

TEST_F(CommandLine, BenchRejectsAFolderWithoutSequences) {
  const fs::path empty = folder_ / "empty";
  fs::create_directories(empty);
  const Ran ran = run("bench " + empty.string() + " --out " + out("rejected"));
  EXPECT_EQ(ran.status, 2);
  EXPECT_NE(ran.err.find("found no sequence"), std::string::npos) << ran.err;
}

// Two cameras of the recording as folders that are played, and two that are not there.
std::string live_arguments(const std::string& data) {
  return "live --rig " + data + "/rig.yaml --cameras " + data + "/mav0/cam0," + data +
         "/mav0/cam1,-,- --set features.per_image=500 --progress never ";
}

TEST_F(CommandLine, RecordedLiveRunIsRepeatedToTheByte) {
  const std::string file = out("live.mcap"), journal = out("live.journal");
  const Ran live = run(live_arguments(data()) + "--out " + out("live") + " --record " + file + " --journal " + journal);
  ASSERT_EQ(live.status, 0) << live.err;
  EXPECT_EQ(nlohmann::json::parse(slurp(out("live/summary.json")))["complete"], true);
  EXPECT_TRUE(fs::exists(out("live/report.html")));
  const Ran again =
      run("run " + file + " --out " + out("live_again") + " --replay " + journal + " --set features.per_image=500");
  ASSERT_EQ(again.status, 0) << again.err;
  expect_same_trajectories("live", "live_again");
  const auto seconds = [](const std::string& name) {
    return nlohmann::json::parse(slurp(out(name + "/summary.json")))["parts"];
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
  const std::string trajectory = slurp(out("live_second/trajectory.tum"));
  EXPECT_EQ(trajectory.rfind("# bslam trajectory frame=cam1 ", 0), 0u) << trajectory;
  EXPECT_EQ(slurp(out("live_second_again/trajectory.tum")), trajectory);
}

TEST_F(CommandLine, CtrlCEndsALiveRunWithAllItsFiles) {
  const std::string file = out("ended.mcap"), folder = out("ended");
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    const std::string program = BSLAM_PROGRAM;
    const std::string command = "exec " + program + " " + live_arguments(data()) + "--out " + folder + " --record " +
                                file + " >/dev/null 2>" + out("stderr");
    ::execl("/bin/sh", "/bin/sh", "-c", command.c_str(), static_cast<char*>(nullptr));
    std::_Exit(127);
  }
  // Frames are in the file after half a second of 1.5 s.
  std::error_code error;
  while (!(fs::file_size(file, error) > 50'000 && !error) && ::waitpid(child, nullptr, WNOHANG) == 0)
    std::this_thread::yield();
  ::kill(child, SIGINT);
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFEXITED(status)) << status;
  EXPECT_EQ(WEXITSTATUS(status), 0) << slurp(out("stderr"));
  const auto summary = nlohmann::json::parse(slurp(folder + "/summary.json"));
  EXPECT_EQ(summary["complete"], true);
  EXPECT_GT(summary["frames"]["tracked"], 0);
  EXPECT_TRUE(fs::exists(folder + "/trajectory.tum"));
  EXPECT_EQ(run("data info " + file).err, "");
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
        std::pair(" --out " + data(), "--out: found a folder that is not empty"),
        std::pair("--out " + data() + "/rig.yaml/out", "--out: found "),
        std::pair("--duration 0" + folder, "--duration: Value 0")}) {
    const Ran ran = run(none + arguments);
    EXPECT_EQ(ran.status, 2) << arguments;
    EXPECT_NE(ran.err.find(message), std::string::npos) << arguments << ": " << ran.err;
  }
  const std::string played = "live " + rig + "--cameras " + data() + "/mav0/cam0,-,-,-" + folder;
  for (const char* setting : {" --fps 10", " --exposure auto", " --pixels GREY"}) expect_rejected(played + setting);
  EXPECT_EQ(run("live --list").status, 0);
}

TEST_F(CommandLine, AnInterruptedBenchKeepsTheTableSoFar) {
  const std::string folder = out("bench_interrupted"), log = folder + "/data/run2/log.txt";
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    const std::string path = data();
    std::freopen("/dev/null", "w", stdout);
    ::execl(BSLAM_PROGRAM, BSLAM_PROGRAM, "bench", path.c_str(), "--out", folder.c_str(), "--runs", "1000", "--pace",
            "realtime", static_cast<char*>(nullptr));
    std::_Exit(127);
  }
  while (!fs::exists(log) && ::waitpid(child, nullptr, WNOHANG) == 0) std::this_thread::yield();
  ::kill(child, SIGINT);
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFEXITED(status)) << status;
  EXPECT_EQ(WEXITSTATUS(status), 130);
  const std::string report = slurp(folder + "/report.md");
  EXPECT_NE(report.find("Not complete"), std::string::npos) << report;
  EXPECT_NE(report.find("| data | 1 | "), std::string::npos) << report;
}

TEST_F(CommandLine, AnInterruptedRunWritesItsResultsAndReportsIt) {
  const std::string folder = out("interrupted");
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    const std::string path = data();
    std::freopen("/dev/null", "w", stdout);
    ::execl(BSLAM_PROGRAM, BSLAM_PROGRAM, "run", path.c_str(), "--out", folder.c_str(), "--pace", "realtime",
            "--progress", "never", static_cast<char*>(nullptr));
    std::_Exit(127);
  }
  // The output folder is created before the first frame; at the recorded pace the run then takes 1.5 s.
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
