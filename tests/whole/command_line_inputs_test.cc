// The command-line program: what it says about recordings, calibrations and maps that do not fit.
#include "rig_formats/rig_file.h"
#include "whole/command_line.h"

namespace bslam {
namespace {

// Folders of the images of all cameras, numbered from `first`; those of camera `late` from the number after it.
void write_numbered(const fs::path& data, const fs::path& folder, int late, std::size_t first = 0) {
  for (int c = 0; c < 4; ++c) {
    const std::string camera = "cam" + std::to_string(c);
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(data / "mav0" / camera / "data")) files.push_back(entry.path());
    std::ranges::sort(files, {}, [](const fs::path& file) { return std::stoll(file.stem().string()); });
    fs::create_directories(folder / camera);
    for (std::size_t k = 0; k < files.size(); ++k)
      fs::copy_file(files[k], folder / camera / (std::to_string(first + k + (c == late ? 1 : 0)) + ".png"));
  }
}

TEST_F(CommandLine, DataInfoHasTheExitStatusOfTheRun) {
  write_numbered(data(), out("numbered"), -1);
  const Ran uncalibrated = run("data info " + out("numbered") + " --rate 10");
  EXPECT_EQ(uncalibrated.status, 0);
  EXPECT_NE(uncalibrated.out.find("missing for bslam run: no calibration in "), std::string::npos) << uncalibrated.out;
  EXPECT_EQ(run("data info " + out("numbered")).status, 2);  // and without time stamps
  const std::string with_rig = out("numbered") + " --rate 10 --rig " + data() + "/rig.yaml";
  const Ran accepted = run("data info " + with_rig);
  EXPECT_EQ(accepted.status, 0) << accepted.out;
  EXPECT_NE(accepted.out.find("10.0 Hz  0.000 s  1.400 s  names, 10 images per second"), std::string::npos)
      << accepted.out;
  const Ran late = run("data info " + with_rig + " --begin 9");
  EXPECT_EQ(late.status, 2);
  EXPECT_NE(late.out.find("refused by bslam run: --begin: found 9 s"), std::string::npos) << late.out;
  expect_rejected("run " + with_rig + " --late drop --out " + out("rejected"));
}

TEST_F(CommandLine, AFileThatIsNoRecordingOfRerunIsNotReplaced) {
  support::write_text(out("notes.rrd"), "precious");
  const Ran kept = run("run " + data() + " --overwrite --rerun " + out("notes.rrd") + " --out " + out("rejected"));
  EXPECT_EQ(kept.status, 2);
  EXPECT_NE(kept.err.find("notes.rrd: --rerun: found an existing file of another kind"), std::string::npos) << kept.err;
  EXPECT_EQ(read_text(out("notes.rrd")), "precious");
}

TEST_F(CommandLine, ACameraThatIsOneFrameLateIsNamed) {
  write_numbered(data(), out("late"), 1);
  const std::string rig = data() + "/rig.yaml";
  const std::string name = rig_formats::read_rig(rig)->camera(1u).name;
  const Ran info = run("rig info " + rig + " --images " + out("late") + " --rate 10");
  EXPECT_NE(info.out.find("warning: " + name + ": its images are about one frame late compared with "),
            std::string::npos)
      << info.out;
  EXPECT_EQ(run("rig info " + rig + " --images " + data()).out.find("about one frame"), std::string::npos);
}

TEST_F(CommandLine, AMapHasTheCalibrationOfItsRecordingAndNamesOfItsOwn) {
  const std::string map = out("titled.map");
  summary_of("titled", "--save-map " + map);
  constexpr std::size_t kFirst = 10;  // at 10 Hz, the time stamp of the first simulated image
  write_numbered(data(), out("unrigged"), -1, kFirst);
  const Ran exported = run("map export " + map + " --format colmap --images " + out("unrigged") + " --rate 10 --out " +
                           out("unrigged_model"));
  EXPECT_EQ(exported.status, 0) << exported.err;
  const camera::Rig rig = rig_formats::read_rig(data() + "/rig.yaml").value();
  std::vector<camera::RigCamera> cameras;
  for (std::size_t c = 0; c < rig.size(); ++c) {
    cameras.push_back({rig.camera(c), rig.body_from_cam(c)});
    cameras.back().camera.name = "eye" + std::to_string(c);
  }
  ASSERT_TRUE(rig_formats::write_rig(camera::Rig(cameras), out("eyes.yaml")));
  const Ran renamed = run("run " + data() + " --end 0.5 --set features.per_image=500 --progress never --rig " +
                          out("eyes.yaml") + " --load-map " + map + " --out " + out("eyes"));
  EXPECT_NE(
      renamed.err.find("has other names for the cameras of this run, which are known by their calibrations: eye0 = " +
                       rig.camera(0u).name + ", eye1 = "),
      std::string::npos)
      << renamed.err;
}

}  // namespace
}  // namespace bslam
