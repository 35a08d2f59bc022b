// The command-line program: exit status, help, and one-line errors.
#include "whole/command_line.h"

#include "rig_formats/rig_file.h"

namespace bslam {
namespace {

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
      {base + " --seed -1", "bslam: command line: --seed: found -1, expected a whole number from 0 to 2147483647\n"},
      {base + " --rate fast", "bslam: command line: --rate: found fast, expected a number\n"},
      {base + " --pace slow", "bslam: command line: --pace: found slow, expected one of: fast, realtime\n"},
      {base + " --rig", "bslam: command line: --rig: found no value after it, expected a value\n"},
      {base + " --load-map ''", "bslam: command line: --load-map: found an empty value, expected a value\n"},
      {"rig info ''", "bslam: command line: FILE: found an empty value, expected a value\n"},
      {base + " --no-report --rerun r.rrd", "as well, expected one of --"},
      {"eval a b --max-dt -1", "--max-dt: found -1, expected a number from 0 to 1000000\n"},
      {"eval a b --camera 1", "command line: --camera: found no --rig, expected --rig as well\n"},
      {"eval a b --camera -1", "--camera: found -1, expected a whole number of 0 or more\n"},
      {"run", "DATA is required (see bslam run --help)\n"}};
  for (const auto& [arguments, message] : cases) {
    const Ran ran = run(arguments);
    EXPECT_EQ(ran.status, 2) << arguments;
    EXPECT_NE(ran.err.find(message), std::string::npos) << arguments << ": " << ran.err;
  }
}

TEST_F(CommandLine, ARunSaysWhichFolderIsWhichCamera) {
  const camera::Rig rig = rig_formats::read_rig(data() + "/rig.yaml").value();
  std::string named = "cameras: ", ordered = "cameras: ";
  for (std::size_t c = 0; c < rig.size(); ++c) {
    const fs::path images = fs::path(data()) / "mav0" / ("cam" + std::to_string(c)) / "data";
    const std::string &name = rig.camera(c).name, by_name = out("by_name/" + name),
                      other = out("other/image_" + std::to_string(c + 8));
    for (const std::string& folder : {by_name, other}) {
      fs::create_directories(folder);
      fs::copy(images, folder, fs::copy_options::recursive);
    }
    named += (c == 0 ? "" : ", ") + name + " = " + by_name;
    ordered += (c == 0 ? "" : ", ") + name + " = " + other;
  }
  const std::string more = " --rig " + data() + "/rig.yaml --end 0.2 --no-report --progress never --out ";
  const Ran of_named = run("run " + out("by_name") + more + out("of_named"));
  EXPECT_TRUE(of_named.err.starts_with(named + " (by their names)\n")) << of_named.err;
  const Ran of_other = run("run " + out("other") + more + out("of_other"));
  EXPECT_TRUE(of_other.err.starts_with(ordered + " (in the order of their names; choose with --topics)\n"))
      << of_other.err;
}

TEST_F(CommandLine, PrintedSettingsCanBeRead) {
  const Ran all = run("settings --set features.levels=5");
  EXPECT_EQ(all.status, 0);
  EXPECT_NE(all.out.find("levels: 5"), std::string::npos);
  support::write_text(out("settings.yaml"), all.out);
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
  support::write_text(interpreter,
                      "#!/bin/sh\ncase \"$2\" in\n*is_reachable*) exit 3 ;;\n"
                      "*main*) printf 'log\\n\\033[1;31mError\\033[0m: no room\\n'; exit 2 ;;\nesac\n");
  fs::permissions(interpreter, fs::perms::owner_all);
  ::setenv("BSLAM_PYTHON", interpreter.c_str(), 1);
  support::write_text(file, "RRF2 precious");
  const std::string base = "run " + data() + " --end 0.3 --set features.per_image=300 --progress never --out ";
  for (const auto& [target, message] :
       {std::pair(file, "run.rrd: --rerun: found an existing file"),
        std::pair(out("none/a.rrd"), "--rerun: found no such folder"),
        std::pair(std::string("rerun+http://127.0.0.1:9/proxy"), "found no viewer at")}) {
    expect_rejected(base + out("rejected") + " --rerun " + target);
    EXPECT_NE(run(base + out("rejected") + " --rerun " + target).err.find(message), std::string::npos) << target;
  }
  EXPECT_EQ(read_text(file), "RRF2 precious");
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
  EXPECT_EQ(read_text(out("one.bvoc")), read_text(out("two.bvoc")));
  expect_rejected(train + "--out " + out("one.bvoc"));  // exists already, and --overwrite is not given
  EXPECT_EQ(run(train + "--overwrite --out " + out("one.bvoc")).status, 0);
  const Ran info = run("vocab info " + out("one.bvoc"));
  EXPECT_NE(info.out.find("branching    6\nlevels       3\nwords        216\n"), std::string::npos) << info.out;

  summary_of("worded", "--cameras 0,1 --vocabulary " + out("one.bvoc") + " --save-map " + out("worded.map"));
  expect_rejected("run " + data() + " --out " + out("rejected") + " --cameras 0,1 --load-map " +
                  out("worded.map"));  // another vocabulary
  const std::string same =
      "--cameras 0,1 --vocabulary " + out("one.bvoc") + " --localize-only --load-map " + out("worded.map");
  EXPECT_EQ(summary_of("worded_again", same)["frames"]["tracked"], 15);
}

TEST_F(CommandLine, SimulateWritesAUsableRecording) {
  const Ran made = run("simulate --out " + out("simulated") + " --duration 0.5 --rate 10 --progress never");
  ASSERT_EQ(made.status, 0) << made.err;
  const Ran ran = run("run " + out("simulated") + " --out " + out("of_simulated") + " --progress never");
  ASSERT_EQ(ran.status, 0) << ran.err;
  EXPECT_EQ(nlohmann::json::parse(read_text(out("of_simulated") + "/summary.json"))["frames"]["tracked"], 5);
}

TEST_F(CommandLine, InspectWritesAConsistentBundledTable) {
  const Ran ran = run("inspect " + data() + " --frame 3 --out " + out("frame.json"));
  ASSERT_EQ(ran.status, 0) << ran.err;
  const auto frame = nlohmann::json::parse(read_text(out("frame.json")));
  std::size_t keypoints = 0, seen = 0, matched = 0;
  for (const auto& camera : frame["cameras"]) keypoints += camera["keypoints"].size();
  for (const auto& feature : frame["features"]) {
    seen += feature["observations"].size();
    matched += feature["observations"].size() > 1;
  }
  EXPECT_EQ(seen, keypoints);
  EXPECT_GT(matched, 100u);
}

}  // namespace
}  // namespace bslam
