#include <bslam/bslam.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <type_traits>
#include <utility>

#include "api/textured_wall.h"
#include "support/data_on_disk.h"

namespace bslam {
namespace {

using support::TemporaryFolder;
using testing::TexturedWall;

TEST(PublicPose, ComposesInvertsAndConvertsFromItsMatrix) {
  Pose T_a_b;
  T_a_b.rotation = {0, 0, std::sqrt(0.5), std::sqrt(0.5)};  // 90 degrees about z
  T_a_b.translation = {1, 2, 3};
  const auto p = T_a_b * std::array<double, 3>{1, 0, 0};
  EXPECT_NEAR(p[0], 1, 1e-12);
  EXPECT_NEAR(p[1], 3, 1e-12);
  const Matrix4 identity = (T_a_b * T_a_b.inverse()).matrix();
  for (int i = 0; i < 16; ++i) EXPECT_NEAR(identity[static_cast<std::size_t>(i)], i % 5 == 0, 1e-12);
  const Matrix4 rows = T_a_b.matrix();
  EXPECT_DOUBLE_EQ(rows[3], 1);
  EXPECT_NEAR(rows[4], 1, 1e-12);  // row 1, column 0
  EXPECT_NEAR(Pose::from_matrix(rows)->rotation[2], std::sqrt(0.5), 1e-12);
  Matrix4 mirrored = rows;
  mirrored[10] = -1;
  EXPECT_FALSE(Pose::from_matrix(mirrored));
}

TEST(PublicTrajectory, NamesItsFrames) {
  const TemporaryFolder folder;
  const auto file = folder.path() / "poses.tum";
  ASSERT_TRUE(write_tum(file, {TimedPose{1'500'000'000, Pose()}}, RigFrame::kBody, "map"));
  const std::string text = support::read_text(file);
  EXPECT_EQ(text.rfind("# bslam trajectory frame=body parent=map final=true\n1.5", 0), 0u) << text;
  EXPECT_EQ(write_tum(file, {}, RigFrame::kBody, "my map").error().key, "parent");
  EXPECT_EQ(write_tum(file, {}, RigFrame::kBody, "").error().key, "parent");
  EXPECT_EQ(support::read_text(file), text);
}

TEST(PublicRig, ReturnsTheCalibrationItWasMadeFrom) {
  CameraCalibration fisheye = TexturedWall::calibration(1);
  fisheye.model = "kannala-brandt";
  fisheye.distortion = {0.01, 0.002, 0, 0};
  fisheye.time_offset_s = 0.004;
  fisheye.mask.assign(static_cast<std::size_t>(fisheye.width) * static_cast<std::size_t>(fisheye.height), 255);
  const Rig rig = Rig::make({TexturedWall::calibration(0), fisheye}).value();
  const CameraCalibration back = rig.camera(1);
  EXPECT_EQ(back.model, fisheye.model);
  EXPECT_EQ(back.distortion, fisheye.distortion);
  EXPECT_EQ(back.mask, fisheye.mask);
  EXPECT_DOUBLE_EQ(back.time_offset_s, 0.004);
  EXPECT_DOUBLE_EQ(back.T_body_cam.translation[0], TexturedWall::kBaseline);
  EXPECT_EQ(rig.subset({1}).value().camera(0).name, "right");
  EXPECT_TRUE(rig.camera(7).name.empty());
}

TEST(PublicRig, RejectsInvalidCameras) {
  const auto rejected = [](auto change) {
    CameraCalibration c = TexturedWall::calibration(0);
    change(c);
    return !Rig::make({c}).ok();
  };
  EXPECT_FALSE(rejected([](CameraCalibration&) {}));
  EXPECT_TRUE(rejected([](CameraCalibration& c) { c.model = "spherical"; }));
  EXPECT_TRUE(rejected([](CameraCalibration& c) { c.width = 0; }));
  EXPECT_TRUE(rejected([](CameraCalibration& c) { c.intrinsics[0] = -1; }));
  EXPECT_TRUE(rejected([](CameraCalibration& c) { c.distortion = {1}; }));
  EXPECT_TRUE(rejected([](CameraCalibration& c) { c.mask = {1, 2}; }));
  EXPECT_TRUE(rejected([](CameraCalibration& c) { c.T_body_cam.translation[0] = 1e9; }));
  EXPECT_TRUE(rejected([](CameraCalibration& c) { c.T_body_cam.rotation = {0, 0, 0, 0}; }));
  EXPECT_FALSE(Rig::make({}));
  EXPECT_FALSE(TexturedWall::rig().subset({0, 0}));
  EXPECT_FALSE(TexturedWall::rig().subset({2}));
  EXPECT_FALSE(TexturedWall::rig().subset({}));
}

TEST(PublicRig, NamesItsCamerasAndRefusesANameTwice) {
  CameraCalibration nameless = TexturedWall::calibration(0), other = TexturedWall::calibration(1);
  nameless.name.clear();
  other.name.clear();
  const Rig rig = Rig::make({nameless, other}).value();
  EXPECT_EQ(rig.camera(0).name, "cam0");
  EXPECT_EQ(rig.camera(1).name, "cam1");
  const TemporaryFolder folder;
  ASSERT_TRUE(rig.save(folder.path() / "rig.yaml"));
  const auto back = Rig::load(folder.path() / "rig.yaml");
  ASSERT_TRUE(back) << back.error().message();
  EXPECT_EQ(back->camera(1).name, "cam1");
  const auto twice = Rig::make({TexturedWall::calibration(0), TexturedWall::calibration(0)});
  ASSERT_FALSE(twice);
  EXPECT_NE(twice.error().message().find("left"), std::string::npos);
  other.name = "cam0";
  EXPECT_FALSE(Rig::make({nameless, other}));
}

TEST(PublicRig, IsNeverEmpty) {
  static_assert(!std::is_constructible_v<Rig, std::nullptr_t> && !std::is_constructible_v<MapView, std::nullptr_t>);
  Rig rig = TexturedWall::rig();
  const Rig moved = std::move(rig);
  EXPECT_EQ(moved.size(), 2u);
  EXPECT_EQ(rig.size(), 2u);  // NOLINT: the state after a move is defined
}

TEST(PublicRig, LoadsFilesFoldersAndMasks) {
  const TemporaryFolder folder;
  support::write_small_euroc(folder.path());
  const auto euroc = Rig::load(folder.path());
  ASSERT_TRUE(euroc) << euroc.error().message();
  EXPECT_EQ(euroc->size(), 2u);
  ASSERT_TRUE(euroc->save(folder.path() / "rig.yaml"));
  std::string text = support::read_text(folder.path() / "rig.yaml");
  EXPECT_EQ(Rig::load(folder.path() / "rig.yaml")->camera(1).T_body_cam.translation,
            euroc->camera(1).T_body_cam.translation);
  EXPECT_FALSE(Rig::load("/no/such/file"));
}

TEST(PublicRig, SavesItsMasks) {
  const TemporaryFolder folder;
  CameraCalibration masked = TexturedWall::calibration(1);
  masked.mask.assign(static_cast<std::size_t>(masked.width) * static_cast<std::size_t>(masked.height), 255);
  for (std::size_t i = 0; i < masked.mask.size(); i += 7) masked.mask[i] = static_cast<std::uint8_t>(i % 5);
  const Rig rig = Rig::make({TexturedWall::calibration(0), masked}).value();
  const auto file = folder.path() / "robot.yaml";
  ASSERT_TRUE(rig.save(file));
  const auto again = Rig::load(file);
  ASSERT_TRUE(again) << again.error().message();
  EXPECT_TRUE(again->camera(0).mask.empty());
  EXPECT_EQ(again->camera(1).mask, masked.mask);
  EXPECT_TRUE(std::filesystem::exists(folder.path() / "robot_mask1.png"));
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "robot_mask0.png"));
  std::filesystem::create_directory(folder.path() / "other_mask1.png");
  EXPECT_FALSE(rig.save(folder.path() / "other.yaml"));
}

TEST(PublicRig, SaysThatItReadsNoMaskInsideOfARecording) {
  const TemporaryFolder folder;
  support::write_text(folder.path() / "walk.mcap", "recording");
  const auto file = folder.path() / "robot.yaml";
  ASSERT_TRUE(Rig::make({TexturedWall::calibration(0)}).value().save(file));
  std::string text = support::read_text(file);
  const std::size_t at = text.find("mask: ") + 6;
  text.replace(at, text.find('\n', at) - at, "walk.mcap/masks/cam0.png");
  support::write_text(file, text);
  const auto rig = Rig::load(file);
  ASSERT_FALSE(rig);
  EXPECT_NE(rig.error().found.find("inside of the recording"), std::string::npos) << rig.error().message();
}

TEST(PublicConfig, SetsByNameAndRejectsInvalidValues) {
  Config config;
  EXPECT_TRUE(config.set("features.per_image", "777"));
  EXPECT_EQ(*config.get("features.per_image"), "777");
  const Status unknown = config.set("features.per_imag", "1");
  ASSERT_FALSE(unknown);
  EXPECT_NE(unknown.error().message().find("features.per_image"), std::string::npos);
  EXPECT_FALSE(config.set("features.per_image", "many"));
  EXPECT_FALSE(config.set("features.per_image", "-5"));
  EXPECT_FALSE(config.set("mode", "sideways"));
  EXPECT_FALSE(config.set_seed(-1));
  EXPECT_FALSE(config.get("nothing"));
  EXPECT_EQ(*config.get("features.per_image"), "777");
  EXPECT_EQ(*config.get("execution.await_calibration"), "false");  // no frame of live cameras waits
  EXPECT_EQ(*config.get("execution.await_mapping_s"), "0.0");
  config.set_mode(Mode::kLagged);
  EXPECT_EQ(*config.get("mode"), "lagged");
}

TEST(PublicConfig, IsAValueTypeAndRoundTripsThroughYaml) {
  const TemporaryFolder folder;
  Config a;
  ASSERT_TRUE(a.set("seed", "9"));
  Config b = a;
  ASSERT_TRUE(b.set("seed", "10"));
  EXPECT_EQ(*a.get("seed"), "9");
  support::write_text(folder.path() / "c.yaml", b.to_yaml());
  ASSERT_TRUE(a.load(folder.path() / "c.yaml"));
  EXPECT_EQ(a.to_yaml(), b.to_yaml());
  support::write_text(folder.path() / "bad.yaml", "seed: 3\nsed: 4\n");
  EXPECT_FALSE(a.load(folder.path() / "bad.yaml"));
  EXPECT_EQ(*a.get("seed"), "10");
  EXPECT_EQ(a.settings().size(), Config().settings().size());
  EXPECT_FALSE(a.settings().front().help.empty());
}

}  // namespace
}  // namespace bslam
