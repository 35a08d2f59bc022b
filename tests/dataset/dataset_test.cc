#include "dataset/dataset.h"

#include <gtest/gtest.h>

#include <fstream>

#include "dataset/frame_reader.h"
#include "dataset/recording_description.h"
#include "rig_formats/rig_file.h"
#include "support/data_on_disk.h"

namespace bslam::dataset {
namespace {

namespace fs = std::filesystem;
using image::ImageState;

// A small EuRoC data set to damage.
class SmallEuroc : public testing::Test {
 protected:
  void SetUp() override { support::write_small_euroc(data()); }

  fs::path data() const { return folder_.path() / "small"; }
  fs::path camera(int c) const { return data() / "mav0" / ("cam" + std::to_string(c)); }
  fs::path image(int k, int c = 0) const { return camera(c) / "data" / support::small_image_name(k); }
  Result<Dataset> open() const { return open_dataset({.path = data()}); }

  void edit(const fs::path& file, const std::string& from, const std::string& to) {
    std::string text = support::read_text(file);
    const std::size_t at = text.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    support::write_text(file, text.replace(at, from.size(), to));
  }
  std::string line(int k) const { return support::small_list({k}).substr(support::small_list({}).size()); }

  // Expects that opening fails with a message that names the file.
  void expect_error(const fs::path& file, std::string_view found) const {
    const auto dataset = open();
    ASSERT_FALSE(dataset);
    EXPECT_EQ(dataset.error().file, file.string()) << dataset.error().message();
    EXPECT_NE(dataset.error().found.find(found), std::string::npos) << dataset.error().message();
  }

  // Expects that the data set opens and only image 20 of camera 0 is damaged.
  void expect_one_damaged() const {
    const auto dataset = open();
    ASSERT_TRUE(dataset) << dataset.error().message();
    ASSERT_EQ(dataset->frames.size(), static_cast<std::size_t>(support::kSmallFrames));
    for (std::size_t k = 0; k < dataset->frames.size(); ++k) {
      const image::ImageBundle bundle = read_frame(*dataset, k);
      EXPECT_EQ(bundle.images[0].state, k == 20 ? ImageState::kDamaged : ImageState::kPresent) << k;
      EXPECT_EQ(bundle.images[0].image.empty(), k == 20);
      EXPECT_EQ(bundle.images[1].state, ImageState::kPresent);
    }
  }

  support::TemporaryFolder folder_;
};

TEST_F(SmallEuroc, Opens) {
  const auto dataset = open();
  ASSERT_TRUE(dataset) << dataset.error().message();
  EXPECT_EQ(dataset->name, "small");
  EXPECT_EQ(dataset->format, DatasetFormat::kEuroc);
  EXPECT_EQ(dataset->frames.size(), static_cast<std::size_t>(support::kSmallFrames));
  EXPECT_EQ(dataset->first_time_ns, support::kSmallStart);
  EXPECT_EQ(dataset->frames[3].time_ns, support::kSmallStart + 3 * support::kSmallInterval);
  EXPECT_EQ(dataset->cameras_used, (std::vector<int>{0, 1}));
  EXPECT_EQ(dataset->rig.camera(std::size_t{1}).name, "cam1");
  EXPECT_NEAR(dataset->rig.rig_from_cam(1).translation().x(), 0.1, 1e-12);
  EXPECT_TRUE(dataset->warnings.empty());
  EXPECT_FALSE(dataset->ground_truth);
}

TEST_F(SmallEuroc, ReadsFrames) {
  const auto dataset = open();
  ASSERT_TRUE(dataset);
  const image::ImageBundle bundle = read_frame(*dataset, 5);
  EXPECT_EQ(bundle.id, FrameId(5));
  EXPECT_EQ(bundle.time_ns, support::kSmallStart + 5 * support::kSmallInterval);
  ASSERT_EQ(bundle.images.size(), 2u);
  for (const image::CameraImage& image : bundle.images) {
    EXPECT_EQ(image.state, ImageState::kPresent);
    EXPECT_EQ(image.time_ns, bundle.time_ns);
    EXPECT_EQ(image.image.width(), support::kSmallWidth);
    EXPECT_EQ(image.image.height(), support::kSmallHeight);
  }
}

TEST_F(SmallEuroc, OpensByItsMav0FolderToo) {
  const auto dataset = open_dataset({.path = data() / "mav0"});
  ASSERT_TRUE(dataset) << dataset.error().message();
  EXPECT_EQ(dataset->name, "small");
  EXPECT_EQ(open_dataset({.path = data() / ""}).value().name, "small");
}

TEST_F(SmallEuroc, ReportsItsGroundTruth) {
  support::write_text(data() / "mav0" / "state_groundtruth_estimate0" / "data.csv", "#\n");
  EXPECT_EQ(open().value().ground_truth, data() / "mav0" / "state_groundtruth_estimate0" / "data.csv");
}

TEST_F(SmallEuroc, UsesCamerasInTheRequestedOrder) {
  const auto dataset = open_dataset({.path = data(), .cameras = {1, 0}});
  ASSERT_TRUE(dataset) << dataset.error().message();
  EXPECT_EQ(dataset->rig.camera(std::size_t{0}).name, "cam1");
  EXPECT_EQ(dataset->frames[0].images[0]->path, image(0, 1));
  EXPECT_EQ(open_dataset({.path = data(), .cameras = {1}}).value().rig.size(), 1u);
  ASSERT_TRUE(dataset->whole_rig);
  EXPECT_EQ(dataset->whole_rig->camera(std::size_t{0}).name, "cam0");
  EXPECT_EQ(open_dataset({.path = data(), .cameras = {1}}).value().whole_rig->size(), 2u);
}

TEST_F(SmallEuroc, IgnoresOtherCameras) {
  support::write_text(camera(1) / "sensor.yaml", "broken: [");
  EXPECT_FALSE(open());
  const auto one = open_dataset({.path = data(), .cameras = {0}});
  ASSERT_TRUE(one);
  EXPECT_FALSE(one->whole_rig);
}

TEST_F(SmallEuroc, RejectsRepeatedAndMissingCameras) {
  for (const std::vector<int>& cameras : {std::vector<int>{0, 9}, {0, 0}, {-1}, {2}}) {
    const auto dataset = open_dataset({.path = data(), .cameras = cameras});
    ASSERT_FALSE(dataset);
    EXPECT_EQ(dataset.error().file, "--cameras");
  }
}

TEST_F(SmallEuroc, RestrictsFramesToTheTimeRange) {
  const auto dataset = open_dataset({.path = data(), .begin_s = 0.1, .end_s = 0.25});
  ASSERT_TRUE(dataset) << dataset.error().message();
  ASSERT_EQ(dataset->frames.size(), 3u);
  EXPECT_EQ(dataset->frames.front().time_ns, support::kSmallStart + 2 * support::kSmallInterval);
  EXPECT_EQ(dataset->first_time_ns, support::kSmallStart);
}

TEST_F(SmallEuroc, RejectsEmptyAndReversedRanges) {
  EXPECT_EQ(open_dataset({.path = data(), .begin_s = 5, .end_s = 1}).error().file, "--begin");
  EXPECT_EQ(open_dataset({.path = data(), .begin_s = 1, .end_s = 1}).error().file, "--begin");
  EXPECT_EQ(open_dataset({.path = data(), .begin_s = 100}).error().file, "--begin");
  EXPECT_EQ(open_dataset({.path = data(), .end_s = 0}).error().file, "--end");
  EXPECT_FALSE(open_dataset({.path = data(), .begin_s = -1}));
  EXPECT_FALSE(open_dataset({.path = data(), .begin_s = std::nan("")}));
}

TEST_F(SmallEuroc, IgnoresARigFileInItsFolderUnlessRequested) {
  support::write_text(data() / "rig.yaml", "bslam_rig: 1\ncameras: nonsense\n");
  EXPECT_TRUE(open());
  EXPECT_FALSE(open_dataset({.path = data(), .rig_file = data() / "rig.yaml"}));
}

TEST_F(SmallEuroc, TakesTheNamesOfTheSameCamerasFromARigFileInItsFolder) {
  std::string yaml = rig_formats::rig_to_yaml(rig_formats::read_rig(data()).value());
  yaml.replace(yaml.find("cam1"), 4, "right");
  support::write_text(data() / "rig.yaml", yaml);
  const auto dataset = open();
  ASSERT_TRUE(dataset) << dataset.error().message();
  EXPECT_EQ(dataset->rig.camera(std::size_t{0}).name, "cam0");
  EXPECT_EQ(dataset->rig.camera(std::size_t{1}).name, "right");
  const auto second = open_dataset({.path = data(), .cameras = {1}});
  ASSERT_TRUE(second);
  EXPECT_EQ(second->rig.camera(std::size_t{0}).name, "right");
  const std::size_t at = yaml.find("resolution: [") + 13;
  support::write_text(data() / "rig.yaml", yaml.insert(at, "1"));  // another camera
  EXPECT_EQ(open()->rig.camera(std::size_t{1}).name, "cam1");
}

TEST_F(SmallEuroc, UsesAnotherRig) {
  std::string yaml = rig_formats::rig_to_yaml(rig_formats::read_rig(data()).value());
  for (std::size_t at = 0; (at = yaml.find("time_offset_s: 0.0", at)) != std::string::npos; ++at) {
    yaml.replace(at, 18, "time_offset_s: 0.5");
  }
  support::write_text(data() / "rig.yaml", yaml);
  const auto dataset = open_dataset({.path = data(), .rig_file = data() / "rig.yaml"});
  ASSERT_TRUE(dataset) << dataset.error().message();
  EXPECT_TRUE(dataset->warnings.empty());
  const auto without = open_dataset({.path = data()});
  ASSERT_TRUE(without);
  ASSERT_EQ(without->warnings.size(), 1u);
  EXPECT_NE(
      without->warnings[0].find("contains time offsets (cam0 500 ms, cam1 500 ms), which are only used with --rig"),
      std::string::npos);
  EXPECT_EQ(dataset->first_time_ns, support::kSmallStart + 500'000'000);
  EXPECT_EQ(read_frame(*dataset, 0).images[1].time_ns, support::kSmallStart + 500'000'000);
  fs::remove_all(camera(1));
  EXPECT_FALSE(open_dataset({.path = data(), .rig_file = data() / "rig.yaml"}));
  EXPECT_TRUE(open_dataset({.path = data(), .rig_file = data() / "rig.yaml", .cameras = {0}}));
}

TEST_F(SmallEuroc, RejectsAMaskOfAnotherSize) {
  std::string yaml = rig_formats::rig_to_yaml(rig_formats::read_rig(data()).value());
  yaml.replace(yaml.find("mask: null"), 10, "mask: mask.png");
  support::write_text(data() / "rig.yaml", yaml);
  EXPECT_FALSE(open_dataset({.path = data(), .rig_file = data() / "rig.yaml"}));
  support::write_image(data() / "mask.png", 5, 5);
  EXPECT_FALSE(open_dataset({.path = data(), .rig_file = data() / "rig.yaml"}));
  support::write_image(data() / "mask.png", support::kSmallWidth, support::kSmallHeight);
  EXPECT_TRUE(open_dataset({.path = data(), .rig_file = data() / "rig.yaml"}));
}

TEST_F(SmallEuroc, ReportsMissingImages) {
  std::vector<int> some;
  for (int k = 0; k < support::kSmallFrames; k += 2) some.push_back(k);
  support::write_text(camera(1) / "data.csv", support::small_list(some));
  const auto dataset = open();
  ASSERT_TRUE(dataset) << dataset.error().message();
  EXPECT_EQ(dataset->frames.size(), static_cast<std::size_t>(support::kSmallFrames));
  EXPECT_EQ(read_frame(*dataset, 2).images[1].state, ImageState::kPresent);
  EXPECT_EQ(read_frame(*dataset, 3).images[1].state, ImageState::kMissing);
}

// ---- invalid folders and files

TEST_F(SmallEuroc, NoSuchFolder) {
  fs::remove_all(data());
  expect_error(data(), "no such file or folder");
}

TEST_F(SmallEuroc, AFileInsteadOfAFolder) {
  fs::remove_all(data());
  support::write_text(data(), "text");
  expect_error(data(), "a file");
}

TEST_F(SmallEuroc, NoCameraInIt) {
  fs::remove_all(data() / "mav0");
  expect_error(data(), "no data set of a known format");
  fs::create_directories(data() / "mav0");
  expect_error(data() / "mav0", "no camera");
}

TEST_F(SmallEuroc, OnlyAPartIsWritten) {
  support::write_text(data() / ".partial", "");
  expect_error(data(), "only a part");
  support::write_text(data() / ".complete", "");
  EXPECT_TRUE(open());
}

TEST_F(SmallEuroc, SensorYamlIsMissing) {
  fs::remove(camera(0) / "sensor.yaml");
  expect_error(camera(0) / "sensor.yaml", "No such file");
}

TEST_F(SmallEuroc, UsesTheRigFileInItsFolderWithoutSensorYaml) {
  support::write_text(data() / "rig.yaml", rig_formats::rig_to_yaml(rig_formats::read_rig(data()).value()));
  edit(data() / "rig.yaml", "cam1", "right");
  fs::remove(camera(0) / "sensor.yaml");
  expect_error(camera(0) / "sensor.yaml", "No such file");  // a recording with some of the files is damaged
  fs::remove(camera(1) / "sensor.yaml");
  const auto dataset = open();
  ASSERT_TRUE(dataset) << dataset.error().message();
  EXPECT_EQ(dataset->rig.camera(std::size_t{1}).name, "right");
}

TEST_F(SmallEuroc, SensorYamlIsNotYaml) {
  support::write_text(camera(0) / "sensor.yaml", "a: [1, 2\n b}");
  expect_error(camera(0) / "sensor.yaml", "invalid YAML");
  EXPECT_EQ(open().error().key, "line 2");
}

TEST_F(SmallEuroc, NegativeFocalLength) {
  edit(camera(0) / "sensor.yaml", "[20, 20,", "[-200.0, 200.0,");
  expect_error(camera(0) / "sensor.yaml", "focal length -200");
}

TEST_F(SmallEuroc, NanFocalLength) {
  edit(camera(0) / "sensor.yaml", "[20, 20,", "[.nan, 20,");
  expect_error(camera(0) / "sensor.yaml", ".nan");
}

TEST_F(SmallEuroc, ThreeIntrinsics) {
  edit(camera(0) / "sensor.yaml", "[20, 20,", "[20,");
  expect_error(camera(0) / "sensor.yaml", "3 numbers");
}

TEST_F(SmallEuroc, UnknownCameraModel) {
  edit(camera(0) / "sensor.yaml", "radial-tangential", "telepathic");
  expect_error(camera(0) / "sensor.yaml", "telepathic");
}

TEST_F(SmallEuroc, TransformIsNotARotation) {
  edit(camera(1) / "sensor.yaml", "[1, 0, 0,", "[2.0, 0, 0,");
  expect_error(camera(1) / "sensor.yaml", "not a rotation");
}

TEST_F(SmallEuroc, TransformIsMirrored) {
  edit(camera(1) / "sensor.yaml", "[1, 0, 0,", "[-1, 0, 0,");
  expect_error(camera(1) / "sensor.yaml", "mirrored");
}

TEST_F(SmallEuroc, TransformHasFifteenNumbers) {
  edit(camera(1) / "sensor.yaml", "[1, 0, 0,", "[1, 0,");
  expect_error(camera(1) / "sensor.yaml", "15 numbers");
}

TEST_F(SmallEuroc, ResolutionOfAnotherCamera) {
  edit(camera(0) / "sensor.yaml", "[32, 24]", "[640, 480]");
  expect_error(camera(0) / "data", "32x24");
}

TEST_F(SmallEuroc, EveryImageOfACameraHasAnotherSize) {
  for (int k = 0; k < support::kSmallFrames; ++k) support::write_image(image(k, 1), 64, 48);
  expect_error(camera(1) / "data", "64x48");
}

TEST_F(SmallEuroc, EmptyList) {
  for (const char* text : {"", "#timestamp [ns],filename\n", "\r\n\n"}) {
    support::write_text(camera(0) / "data.csv", text);
    expect_error(camera(0) / "data.csv", "no images");
  }
}

TEST_F(SmallEuroc, ListAndImagesAreMissing) {
  fs::remove(camera(0) / "data.csv");
  fs::remove_all(camera(0) / "data");
  expect_error(camera(0) / "data.csv", "No such file");
}

TEST_F(SmallEuroc, ImagesWithoutAListHaveTheTimesOfTheirNames) {
  fs::remove(camera(0) / "data.csv");
  const auto dataset = open();
  ASSERT_TRUE(dataset) << dataset.error().message();
  ASSERT_EQ(dataset->frames.size(), static_cast<std::size_t>(support::kSmallFrames));
  EXPECT_EQ(dataset->frames[7].images[0]->path, image(7));
  EXPECT_EQ(dataset->frames[7].images[0]->time_ns, dataset->frames[7].images[1]->time_ns);
  EXPECT_TRUE(dataset->warnings.empty());
}

// A header without #, paths from the folder of the list, and images that were converted after the list was written.
TEST_F(SmallEuroc, ListsOfOtherProgramsNameTheSameImages) {
  std::string list = "timestamp,filename\n";
  for (int k = 0; k < support::kSmallFrames; ++k) {
    const fs::path stamp = fs::path(support::small_image_name(k)).stem();
    list += stamp.string() + ",data/" + stamp.string() + ".png\n";
    fs::rename(image(k), image(k).replace_extension(".jpg"));
  }
  support::write_text(camera(0) / "data.csv", list);
  const auto dataset = open();
  ASSERT_TRUE(dataset) << dataset.error().message();
  ASSERT_EQ(dataset->frames.size(), static_cast<std::size_t>(support::kSmallFrames));
  EXPECT_EQ(dataset->frames[7].images[0]->path, image(7).replace_extension(".jpg"));
  EXPECT_TRUE(dataset->warnings.empty());
}

TEST_F(SmallEuroc, ListContainsWords) {
  edit(camera(0) / "data.csv", line(0), "then,image.png\n");
  expect_error(camera(0) / "data.csv", "then");
  EXPECT_EQ(open().error().key, "line 2");
}

TEST_F(SmallEuroc, ListWithoutFileNames) {
  edit(camera(0) / "data.csv", line(0), "123\n");
  expect_error(camera(0) / "data.csv", "123");
}

TEST_F(SmallEuroc, TimestampsOutOfRange) {
  for (const char* time : {"-5", "99999999999999999999", "9223372036854775807", "4600000000000000000", "1.5"}) {
    support::write_text(camera(0) / "data.csv", std::string(time) + ",a.png\n");
    expect_error(camera(0) / "data.csv", time);
  }
}

TEST_F(SmallEuroc, RepeatedTimestampsAreDroppedWithAWarning) {
  edit(camera(0) / "data.csv", line(4), line(4) + line(4));
  const auto dataset = open();
  ASSERT_TRUE(dataset) << dataset.error().message();
  EXPECT_EQ(dataset->frames.size(), static_cast<std::size_t>(support::kSmallFrames));
  EXPECT_EQ(dataset->warnings.size(), 1u);
}

TEST_F(SmallEuroc, TimestampsOutOfOrderAreSortedWithAWarning) {
  edit(camera(0) / "data.csv", line(5) + line(6) + line(7), line(7) + line(6) + line(5));
  const auto dataset = open();
  ASSERT_TRUE(dataset) << dataset.error().message();
  EXPECT_EQ(dataset->frames[6].images[0]->path, image(6));
  EXPECT_EQ(dataset->warnings.size(), 1u);
}

TEST_F(SmallEuroc, CamerasWithNoCommonTime) {
  std::string list;
  for (int k = 0; k < 20; ++k)
    list += std::to_string(3'900'000'000'000'000'000 + k * support::kSmallInterval) + "," +
            support::small_image_name(k) + "\n";
  support::write_text(camera(1) / "data.csv", list);
  expect_error(data(), "after those of cam0");
}

// Delays between 3/20 and 9/20 of the interval, too different to be a constant one.
TEST_F(SmallEuroc, ImagesAtVaryingTimesHaveFramesOfTheirOwn) {
  std::string list;
  for (int k = 0; k < support::kSmallFrames; ++k) {
    const TimeNs later_ns = support::kSmallInterval / 20 * (3 + 2 * (k % 4));
    list += std::to_string(support::kSmallStart + k * support::kSmallInterval + later_ns) + "," +
            support::small_image_name(k) + "\n";
  }
  support::write_text(camera(1) / "data.csv", list);
  const auto apart = open_dataset({.path = data()});
  ASSERT_TRUE(apart);
  EXPECT_EQ(apart->frames.size(), 2u * support::kSmallFrames);
  ASSERT_EQ(apart->warnings.size(), 1u);
  EXPECT_NE(apart->warnings[0].find("not within 2 ms of an image of cam0"), std::string::npos);
  const auto together = open_dataset({.path = data(), .sync_tolerance_s = 0.026});
  ASSERT_TRUE(together);
  EXPECT_EQ(together->frames.size(), 1u * support::kSmallFrames);
  EXPECT_TRUE(together->warnings.empty());
}

// By up to 4 % of the interval, which is more than the tolerance.
TEST_F(SmallEuroc, ImagesWithImpreciseTimesShareFrames) {
  std::string list;
  for (int k = 0; k < support::kSmallFrames; ++k) {
    const TimeNs later_ns = support::kSmallInterval / 50 * (k % 5 - 2);
    list += std::to_string(support::kSmallStart + k * support::kSmallInterval + later_ns) + "," +
            support::small_image_name(k) + "\n";
  }
  support::write_text(camera(1) / "data.csv", list);
  const auto data_set = open_dataset({.path = data(), .sync_tolerance_s = 0.001});
  ASSERT_TRUE(data_set);
  EXPECT_EQ(data_set->frames.size(), 1u * support::kSmallFrames);
  EXPECT_TRUE(data_set->warnings.empty());
}

TEST_F(SmallEuroc, AlternatingCamerasShareFrames) {
  std::string list;
  for (int k = 0; k < support::kSmallFrames; ++k) {
    list += std::to_string(support::kSmallStart + k * support::kSmallInterval + support::kSmallInterval / 2) + "," +
            support::small_image_name(k) + "\n";
  }
  support::write_text(camera(1) / "data.csv", list);
  const auto data_set = open_dataset({.path = data()});
  ASSERT_TRUE(data_set);
  EXPECT_EQ(data_set->frames.size(), 1u * support::kSmallFrames);
  EXPECT_TRUE(data_set->warnings.empty());
}

TEST_F(SmallEuroc, NoneOfTheListedImagesExists) {
  fs::remove_all(camera(1) / "data");
  expect_error(image(0, 1), "no such file, as for all 24 listed images");
}

TEST_F(SmallEuroc, OneImageIsTruncated) {
  const std::string bytes = support::read_text(image(20));
  ASSERT_GT(bytes.size(), 500u);
  support::write_text(image(20), bytes.substr(0, 500));
  expect_one_damaged();
}

TEST_F(SmallEuroc, OneImageIsEmpty) {
  support::write_text(image(20), "");
  expect_one_damaged();
}

TEST_F(SmallEuroc, OneImageIsMissing) {
  fs::remove(image(20));
  expect_one_damaged();
}

TEST_F(SmallEuroc, AnImageIsATextFile) {
  support::write_text(image(20), "not an image");
  expect_one_damaged();
}

TEST_F(SmallEuroc, OneImageHasAnotherSize) {
  support::write_image(image(20), 31, 24);
  expect_one_damaged();
}

TEST_F(SmallEuroc, TheFirstImagesMayBeDamaged) {
  for (int k = 0; k < 10; ++k) support::write_text(image(k), "not an image");
  EXPECT_TRUE(open());
  fs::remove(image(0));
  support::write_image(image(1), 10, 10);
  EXPECT_TRUE(open_dataset({.path = data(), .cameras = {1}}));
}

TEST_F(SmallEuroc, WarnsOfImagesThatAreNotListed) {
  support::write_text(camera(0) / "data.csv", support::small_list({0, 1, 2, 3, 4}));
  const auto dataset = open();
  ASSERT_TRUE(dataset) << dataset.error().message();
  ASSERT_EQ(dataset->warnings.size(), 1u) << dataset->warnings.back();
  EXPECT_EQ(dataset->warnings[0], (camera(0) / "data.csv").string() + ": " + std::to_string(support::kSmallFrames - 5) +
                                      " of " + std::to_string(support::kSmallFrames) + " images in " +
                                      (camera(0) / "data").string() +
                                      " are not listed and are not used, the first: " + support::small_image_name(5));
}

TEST_F(SmallEuroc, IsNotOnlyUncalibratedIfItsListsCannotBeRead) {
  for (const int c : {0, 1}) fs::remove(camera(c) / "sensor.yaml");
  EXPECT_TRUE(describe_recording({.path = data()})->only_uncalibrated);
  for (const int c : {0, 1}) support::write_text(camera(c) / "data.csv", "soon,0.png\n");
  const auto described = describe_recording({.path = data()});
  ASSERT_TRUE(described);
  EXPECT_FALSE(described->only_uncalibrated);
  ASSERT_EQ(described->streams.size(), 2u);
  EXPECT_EQ(described->streams[1].name, "cam1");
  EXPECT_NE(described->streams[1].unused.find("found soon"), std::string::npos) << described->streams[1].unused;
}

TEST_F(SmallEuroc, ReadsListsFromOtherSystems) {
  std::string text = "\xEF\xBB\xBF#timestamp [ns],filename\r\n\r\n# a word\r\n";
  for (int k = 0; k < support::kSmallFrames; ++k) {
    const std::string l = line(k);
    text += "  " + l.substr(0, l.find(',')) + " , " + support::small_image_name(k) + " \r\n";
  }
  support::write_text(camera(0) / "data.csv", text + "\r\n\r\n");
  const auto dataset = open();
  ASSERT_TRUE(dataset) << dataset.error().message();
  EXPECT_EQ(read_frame(*dataset, 23).images[0].state, ImageState::kPresent);
}

TEST_F(SmallEuroc, IncompleteImagesPrintNothing) {
  support::write_text(image(20), support::read_text(image(20)).substr(0, 300));
  support::write_text(image(21), "");
  const auto dataset = open();
  ASSERT_TRUE(dataset);
  testing::internal::CaptureStderr();
  for (std::size_t k = 19; k < 23; ++k) read_frame(*dataset, k);
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

}  // namespace
}  // namespace bslam::dataset
