#include "dataset/live_recording.h"

#include <gtest/gtest.h>

#include "containers/mcap_writer.h"
#include "containers/ros_writer.h"
#include "dataset/dataset.h"
#include "rig_formats/bslam_rig.h"
#include "support/data_on_disk.h"
#include "synthetic/rigs.h"

namespace bslam::dataset {
namespace {

constexpr TimeNs kStart = 1'700'000'000'000'000'000, kInterval = 50'000'000;
const std::vector<std::string> kTopics{"/z/image_raw", "/a/image_raw"};  // not in the order of their names

// Frames of two cameras: as a run got them, the second camera's images are up to 8 ms away, and some are missing.
class LiveRecordingTest : public testing::Test {
 protected:
  // Reading rounds the rotations, once.
  LiveRecordingTest()
      : rig_(rig_formats::read_bslam_rig("rig.yaml", rig_formats::rig_to_yaml(synthetic::ring_rig(2, 64)))->cameras) {}

  void write(const std::string& rig_text, const std::vector<int>& numbers = {0, 1}) {
    auto writer = *containers::McapWriter::create(path());
    ASSERT_TRUE(writer->attach(kLiveRigFile, "application/yaml", rig_text).ok());
    ASSERT_TRUE(writer->add_metadata(kLiveMetadata, live_metadata(kTopics, numbers)).ok());
    for (const std::string& topic : kTopics)
      writer->add_topic(topic, containers::kImageType, containers::image_definition());
    const camera::Camera& camera = rig_.camera(std::size_t{0});
    const std::vector<std::uint8_t> pixels(static_cast<std::size_t>(camera.width * camera.height), 9);
    for (int k = 0; k < 10; ++k) {
      for (std::uint16_t c = 0; c < 2; ++c) {
        if (k == 4 + c) continue;
        const TimeNs stamp_ns = kStart + k * kInterval + c * 8'000'000 * (k % 2);
        const auto message = containers::grey_image_message(stamp_ns, "camera", camera.width, camera.height,
                                                            pixels.data(), camera.width);
        ASSERT_TRUE(writer->write(c, kStart + k * kInterval, message).ok());
      }
    }
    ASSERT_TRUE(writer->finish().ok());
  }
  std::filesystem::path path() const { return folder_.path() / "live.mcap"; }

  support::TemporaryFolder folder_;
  camera::Rig rig_;
};

TEST_F(LiveRecordingTest, HasTheFramesAndTheRigOfTheRun) {
  write(rig_formats::rig_to_yaml(rig_));
  const auto data = open_dataset({.path = path()});
  ASSERT_TRUE(data.ok()) << data.error().message();
  EXPECT_EQ(rig_formats::rig_to_yaml(data->rig), rig_formats::rig_to_yaml(rig_));
  EXPECT_EQ(data->sources, kTopics);
  ASSERT_EQ(data->frames.size(), 10u);
  for (std::size_t k = 0; k < 10; ++k) {
    EXPECT_EQ(data->frames[k].images[0].has_value(), k != 4);
    EXPECT_EQ(data->frames[k].images[1].has_value(), k != 5);
  }
  EXPECT_TRUE(data->warnings.empty()) << data->warnings.front();
}

// `rig` with the rotation of camera 0 that a refined calibration of its principal point has.
camera::Rig turned(const camera::Rig& rig) {
  std::vector<camera::RigCamera> cameras;
  for (std::size_t c = 0; c < rig.size(); ++c) cameras.push_back({rig.camera(c), rig.body_from_cam(c)});
  return camera::Rig(std::move(cameras), {geometry::so3_exp({0, 0.01, 0}), geometry::Vector3d::Zero()});
}

TEST_F(LiveRecordingTest, HasTheRigFrameOfARefinedCalibration) {
  write(rig_formats::rig_to_yaml(turned(rig_)));
  const auto turn_of = [](const camera::Rig& rig) { return geometry::so3_log(rig.cam_from_rig(0).rotation()).norm(); };
  const auto data = open_dataset({.path = path()});
  ASSERT_TRUE(data.ok()) << data.error().message();
  EXPECT_NEAR(turn_of(data->rig), 0.01, 1e-12);
  EXPECT_NEAR(turn_of(open_dataset({.path = path(), .cameras = {0}})->rig), 0.01, 1e-12);
  EXPECT_EQ(turn_of(open_dataset({.path = path(), .cameras = {1}})->rig), 0);
  EXPECT_EQ(turn_of(open_dataset({.path = path(), .topics = {kTopics[1], kTopics[0]}})->rig), 0);
  EXPECT_NEAR(turn_of(open_dataset({.path = path(), .topics = {kTopics[0]}})->rig), 0.01, 1e-12);
}

// Of a run that did not use all cameras of its rig file.
TEST_F(LiveRecordingTest, HasTheNumbersOfItsCamerasInTheRigFile) {
  write(rig_formats::rig_to_yaml(rig_), {1, 3});
  const auto data = open_dataset({.path = path()});
  ASSERT_TRUE(data.ok()) << data.error().message();
  EXPECT_EQ(data->cameras_used, (std::vector{1, 3}));
  EXPECT_FALSE(data->whole_rig);
  EXPECT_EQ(open_dataset({.path = path(), .cameras = {1}})->cameras_used, std::vector{3});
  write(rig_formats::rig_to_yaml(rig_), {1, 1});  // damaged
  EXPECT_EQ(open_dataset({.path = path()})->cameras_used, (std::vector{0, 1}));
}

TEST_F(LiveRecordingTest, IsGroupedByTimeWhereItsFramesAreNone) {
  write(rig_formats::rig_to_yaml(rig_));
  const auto one = open_dataset({.path = path(), .cameras = {1}});
  ASSERT_TRUE(one.ok()) << one.error().message();
  EXPECT_EQ(one->frames.size(), 9u);
  const auto swapped = open_dataset({.path = path(), .topics = {kTopics[1], kTopics[0]}});
  ASSERT_TRUE(swapped.ok()) << swapped.error().message();
  EXPECT_EQ(swapped->frames.size(), 10u);
  EXPECT_EQ(swapped->rig.camera(std::size_t{0}).name, rig_.camera(std::size_t{1}).name);
  EXPECT_TRUE(swapped->frames[4].images[0].has_value());
}

// The order of the topics is that of the rig of the run, so that a rig of its first cameras needs no names of topics.
TEST_F(LiveRecordingTest, HasAnOrderOfItsTopicsForOtherRigs) {
  write(rig_formats::rig_to_yaml(rig_));
  support::write_text(folder_.path() / "one.yaml", rig_formats::rig_to_yaml(rig_.subset(std::vector{0})));
  const auto data = open_dataset({.path = path(), .rig_file = folder_.path() / "one.yaml"});
  ASSERT_TRUE(data.ok()) << data.error().message();
  EXPECT_EQ(data->sources, std::vector{kTopics[0]});
}

// A rig file that has more cameras than were recorded: that of the run, of which it used a part.
TEST_F(LiveRecordingTest, HasTheNumbersOfItsCamerasInOtherRigs) {
  write(rig_formats::rig_to_yaml(rig_), {0, 2});
  const auto file = folder_.path() / "three.yaml";
  std::vector<camera::RigCamera> cameras;
  for (const char* name : {"a", "b", "c"}) {
    cameras.push_back({rig_.camera(std::size_t{0}), rig_.body_from_cam(0)});
    cameras.back().camera.name = name;
  }
  support::write_text(file, rig_formats::rig_to_yaml(camera::Rig(cameras)));
  const auto data = open_dataset({.path = path(), .rig_file = file, .cameras = {2, 0}});
  ASSERT_TRUE(data.ok()) << data.error().message();
  EXPECT_EQ(data->sources, (std::vector{kTopics[1], kTopics[0]}));
  EXPECT_EQ(data->rig.camera(std::size_t{0}).name, "c");
  const std::string refused = path().string() + ": found images of a, c, expected images of camera 1 (b) as well, " +
                              "since " + file.string() +
                              " has 3 cameras; --cameras 0,2 selects those that it has, and --topics names the "
                              "topics of all cameras in their order";
  for (const std::vector<int>& selected : {std::vector<int>(), {0, 1}, {1}}) {
    const auto part = open_dataset({.path = path(), .rig_file = file, .cameras = selected});
    ASSERT_FALSE(part.ok());
    EXPECT_EQ(part.error().message(), refused);
  }
  cameras.pop_back();  // a rig of the recorded cameras
  support::write_text(file, rig_formats::rig_to_yaml(camera::Rig(cameras)));
  EXPECT_EQ(open_dataset({.path = path(), .rig_file = file})->sources, kTopics);
}

TEST_F(LiveRecordingTest, HasTheNamesOfItsCameras) {
  write(rig_formats::rig_to_yaml(rig_), {0, 2});
  const auto file = folder_.path() / "swapped.yaml";
  support::write_text(file, rig_formats::rig_to_yaml(rig_.subset(std::vector{1, 0})));
  const auto data = open_dataset({.path = path(), .rig_file = file});
  ASSERT_TRUE(data.ok()) << data.error().message();
  EXPECT_EQ(data->sources, (std::vector{kTopics[1], kTopics[0]}));
}

// As recordings of earlier versions have it.
TEST_F(LiveRecordingTest, NamesAMaskThatItsRigHasAndNoFile) {
  camera::Camera masked = rig_.camera(std::size_t{0});
  masked.mask_file = (folder_.path() / "there" / "mask.png").string();
  const camera::Rig rig({{masked, rig_.body_from_cam(0)}, {rig_.camera(std::size_t{1}), rig_.body_from_cam(1)}});
  write(rig_formats::rig_to_yaml(rig));
  const auto data = open_dataset({.path = path()});
  ASSERT_FALSE(data.ok());
  EXPECT_EQ(data.error().message(), path().string() + ": " + masked.name + ": found no file " + masked.mask_file +
                                        ", the mask of the rig inside the recording, expected this file, or another "
                                        "calibration with --rig FILE, or masks with --masks DIR");
  EXPECT_TRUE(open_dataset({.path = path(), .cameras = {1}}).ok());
  support::write_image(folder_.path() / "masks" / "cam0.png", masked.width, masked.height);
  EXPECT_TRUE(open_dataset({.path = path(), .masks = folder_.path() / "masks"}).ok());
  support::write_image(masked.mask_file, masked.width, masked.height);
  EXPECT_TRUE(open_dataset({.path = path()}).ok());
}

TEST_F(LiveRecordingTest, SaysWhyItsRigIsNotUsed) {
  write("bslam_rig: 1\ncameras: 7\n");
  const auto data = open_dataset({.path = path()});
  ASSERT_FALSE(data.ok());
  EXPECT_NE(data.error().message().find("--rig"), std::string::npos) << data.error().message();
}

}  // namespace
}  // namespace bslam::dataset
