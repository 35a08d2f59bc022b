#include <gtest/gtest.h>

#include <functional>

#include "dataset/camera_info.h"
#include "dataset/dataset.h"
#include "dataset/frame_reader.h"
#include "dataset/recording_description.h"
#include "image_decoding/image_file.h"
#include "support/bag_writer.h"
#include "support/data_on_disk.h"

namespace bslam::dataset {
namespace {

namespace fs = std::filesystem;
using image::ImageState;
using support::TestMessage;
using support::Wire;

// The small EuRoC data set as a bag, whose messages tests change.
class SmallBag : public testing::Test {
 protected:
  void SetUp() override {
    support::write_small_euroc(data());
    support::write_text(folder_.path() / "rig.yaml", "");
  }

  fs::path data() const { return folder_.path() / "small"; }
  fs::path bag() const { return folder_.path() / "small.bag"; }

  std::string pixels(int camera, int k) const {
    const fs::path file = data() / "mav0" / ("cam" + std::to_string(camera)) / "data" / support::small_image_name(k);
    const image::Image image = image_decoding::read_image(file).value();
    return {reinterpret_cast<const char*>(image.row(0)), static_cast<std::size_t>(image.width() * image.height())};
  }
  support::TestImage image(int camera, int k) const {
    return {support::kSmallStart + k * support::kSmallInterval,
            support::kSmallWidth,
            support::kSmallHeight,
            support::kSmallWidth,
            "mono8",
            pixels(camera, k)};
  }
  static std::string topic(int camera) { return "/cam" + std::to_string(camera) + "/image_raw"; }

  // The images of two cameras, recorded 3 ms after their stamps.
  std::vector<TestMessage> messages(Wire wire) const {
    std::vector<TestMessage> out;
    for (int k = 0; k < support::kSmallFrames; ++k) {
      for (int c = 0; c < 2; ++c) {
        const support::TestImage one = image(c, k);
        out.push_back({topic(c), "sensor_msgs/Image", one.stamp_ns + 3'000'000, support::image_message(wire, one)});
      }
    }
    return out;
  }
  static void add_calibration(std::vector<TestMessage>& to, Wire wire, double fx_times_baseline) {
    for (int c = 0; c < 2; ++c) {
      const double shift = c == 0 ? 0 : -fx_times_baseline;
      const support::TestCalibration info{support::kSmallWidth,
                                          support::kSmallHeight,
                                          "plumb_bob",
                                          {0, 0, 0, 0, 0},
                                          {20, 0, 15.5, 0, 20, 11.5, 0, 0, 1},
                                          {1, 0, 0, 0, 1, 0, 0, 0, 1},
                                          {20, 0, 15.5, shift, 0, 20, 11.5, 0, 0, 0, 1, 0}};
      to.insert(to.begin(), {"/cam" + std::to_string(c) + "/camera_info", "sensor_msgs/CameraInfo",
                             support::kSmallStart, support::calibration_message(wire, info)});
    }
  }
  void write(const std::vector<TestMessage>& messages) const {
    support::write_text(bag(), support::rosbag1_bytes(messages));
  }
  DatasetRequest request(fs::path path) const { return {.path = std::move(path), .rig_file = data()}; }

  static bool has(const std::vector<std::string>& warnings, std::string_view part) {
    return std::ranges::any_of(warnings, [&](const std::string& w) { return w.find(part) != std::string::npos; });
  }

  // Expects frames, times and pixels of the folder.
  void expect_same(const DatasetRequest& of_bag) const {
    const auto folder = open_dataset({.path = data()}), opened = open_dataset(of_bag);
    ASSERT_TRUE(opened) << opened.error().message();
    ASSERT_EQ(opened->frames.size(), folder->frames.size());
    for (std::size_t k = 0; k < folder->frames.size(); ++k) {
      const image::ImageBundle a = read_frame(*folder, k), b = read_frame(*opened, k);
      EXPECT_EQ(a.time_ns, b.time_ns);
      for (std::size_t c = 0; c < 2; ++c) {
        ASSERT_EQ(b.images[c].state, ImageState::kPresent) << describe_damage(*opened, k, c);
        EXPECT_EQ(a.images[c].time_ns, b.images[c].time_ns);
        for (int y = 0; y < a.images[c].image.height(); ++y)
          EXPECT_TRUE(std::equal(a.images[c].image.row(y), a.images[c].image.row(y) + a.images[c].image.width(),
                                 b.images[c].image.row(y)));
      }
    }
  }

  support::TemporaryFolder folder_;
};

TEST_F(SmallBag, Ros1IsReadAsTheFolder) {
  write(messages(Wire::kRos1));
  expect_same(request(bag()));
  const auto dataset = open_dataset(request(bag()));
  EXPECT_EQ(dataset->format, DatasetFormat::kBag);
  EXPECT_EQ(dataset->name, "small");
  EXPECT_EQ(dataset->sources, (std::vector<std::string>{topic(0), topic(1)}));
  EXPECT_TRUE(dataset->warnings.empty()) << dataset->warnings.front();
}

TEST_F(SmallBag, Ros2IsReadAsTheFolder) {
  const auto all = messages(Wire::kCdr);
  const fs::path folder = folder_.path() / "ros2";
  fs::create_directories(folder);
  // Two files of one recording, as a recorder splits it.
  support::write_sqlite_bag(folder / "ros2_0.db3", {all.begin(), all.begin() + 10});
  support::write_sqlite_bag(folder / "ros2_1.db3", {all.begin() + 10, all.end()});
  support::write_text(folder / "metadata.yaml",
                      "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: sqlite3\n"
                      "  relative_file_paths:\n    - ros2_0.db3\n    - ros2_1.db3\n");
  expect_same(request(folder));
  expect_same(request((folder / "ros2_0.db3").string() + "," + (folder / "ros2_1.db3").string()));
  support::write_text(folder_.path() / "a.mcap", support::mcap_bytes(all, Wire::kCdr, {"zstd"}));
  expect_same(request(folder_.path() / "a.mcap"));

  support::write_text(folder / "metadata.yaml", "rosbag2_bagfile_information:\n  version: 5\n");
  const auto without_list = open_dataset(request(folder));
  ASSERT_TRUE(without_list) << without_list.error().message();
  EXPECT_EQ(without_list->frames.size(), static_cast<std::size_t>(support::kSmallFrames));
  EXPECT_TRUE(has(without_list->warnings, "all message files of the folder are read"));

  support::write_text(folder / "metadata.yaml",
                      "rosbag2_bagfile_information:\n  relative_file_paths:\n    - ros2_0.db3\n    - ros2_1.db3\n");
  fs::remove(folder / "ros2_0.db3");
  const auto rest = open_dataset(request(folder));
  ASSERT_TRUE(rest) << rest.error().message();
  EXPECT_TRUE(has(rest->warnings, "ros2_0.db3 is listed but not there"));
}

// Recorders that compress whole files list them with the extension .zstd, which `zstd -d` removes.
TEST_F(SmallBag, DecompressedFilesOfRos2AreFound) {
  const auto all = messages(Wire::kCdr);
  const fs::path folder = folder_.path() / "walk", file = folder / "walk_0.db3", packed = folder / "walk_0.db3.zstd";
  fs::create_directories(folder);
  support::write_sqlite_bag(file, all);
  support::write_text(folder / "metadata.yaml",
                      "rosbag2_bagfile_information:\n  compression_format: zstd\n  compression_mode: FILE\n"
                      "  relative_file_paths:\n    - walk_0.db3.zstd\n");
  for (const bool beside : {false, true}) {
    if (beside) support::write_text(packed, support::compress("zstd", support::read_text(file)));
    expect_same(request(folder));
    EXPECT_TRUE(open_dataset(request(folder))->warnings.empty()) << open_dataset(request(folder))->warnings.front();
  }
  fs::rename(folder / "metadata.yaml", folder_.path() / "metadata.yaml");
  EXPECT_TRUE(open_dataset(request(folder))->warnings.empty()) << open_dataset(request(folder))->warnings.front();
  fs::rename(folder_.path() / "metadata.yaml", folder / "metadata.yaml");
  fs::remove(file);
  const auto not_yet = open_dataset(request(folder));
  ASSERT_FALSE(not_yet);
  EXPECT_EQ(not_yet.error().file, packed.string());
}

TEST_F(SmallBag, FoxgloveIsReadAsTheFolder) {
  std::vector<TestMessage> all = messages(Wire::kProtobuf);
  for (TestMessage& message : all) message.type = "foxglove.RawImage";
  support::write_text(folder_.path() / "a.mcap", support::mcap_bytes(all, Wire::kProtobuf, {"lz4"}));
  expect_same(request(folder_.path() / "a.mcap"));
}

TEST_F(SmallBag, CompressedImagesAreReadAsTheFolder) {
  std::vector<TestMessage> all;
  for (int k = 0; k < support::kSmallFrames; ++k) {
    for (int c = 0; c < 2; ++c) {
      support::TestImage one = image(c, k);
      one.encoding = "mono8; png compressed ";
      one.data =
          support::read_text(data() / "mav0" / ("cam" + std::to_string(c)) / "data" / support::small_image_name(k));
      all.push_back({topic(c) + "/compressed", "sensor_msgs/CompressedImage", one.stamp_ns,
                     support::compressed_image_message(Wire::kRos1, one)});
    }
  }
  write(all);
  expect_same(request(bag()));
  // A broken image is damaged, and the others are not.
  all[8].bytes.resize(all[8].bytes.size() - 40);
  write(all);
  const auto dataset = open_dataset(request(bag()));
  ASSERT_TRUE(dataset);
  EXPECT_EQ(read_frame(*dataset, 4).images[0].state, ImageState::kDamaged);
  EXPECT_NE(describe_damage(*dataset, 4, 0).find("/cam0/image_raw/compressed"), std::string::npos);
  EXPECT_EQ(read_frame(*dataset, 5).images[0].state, ImageState::kPresent);
}

TEST_F(SmallBag, TopicsAreTheCamerasInTheirOrder) {
  write(messages(Wire::kRos1));
  DatasetRequest swapped = request(bag());
  swapped.topics = {topic(1), topic(0)};
  const auto dataset = open_dataset(swapped);
  ASSERT_TRUE(dataset) << dataset.error().message();
  EXPECT_EQ(dataset->sources, (std::vector<std::string>{topic(1), topic(0)}));
  EXPECT_EQ(read_frame(*dataset, 3).images[0].image.row(0)[5], static_cast<std::uint8_t>(pixels(1, 3)[5]));
  swapped.topics = {"/cam7/image_raw"};
  EXPECT_EQ(open_dataset(swapped).error().file, "--topics");
  swapped.topics = {topic(0), topic(0)};
  EXPECT_EQ(open_dataset(swapped).error().found, topic(0) + " twice");
  DatasetRequest folder = request(data());
  folder.topics = {topic(0)};
  EXPECT_EQ(open_dataset(folder).error().file, "--topics");
}

// A rig of two cameras, whose names are given.
std::string rig_of(const std::string& first, const std::string& second) {
  std::string rig = "bslam_rig: 1\ncameras:\n";
  for (const std::string& name : {first, second}) {
    rig += "  - name: " + name +
           "\n    model: pinhole\n    resolution: [32, 24]\n    intrinsics: [20, 20, 15.5, 11.5]\n"
           "    T_body_cam: [[1, 0, 0, " +
           (name == first ? "0" : "0.1") + "], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]\n";
  }
  return rig;
}

// A colour camera and a pair of infrared cameras, of which a rig has two.
TEST_F(SmallBag, MoreTopicsThanCamerasAreAskedAbout) {
  const std::string colour = "/camera/color/image_raw", left = "/camera/infra1/image_rect_raw",
                    right = "/camera/infra2/image_rect_raw";
  std::vector<TestMessage> all;
  for (int k = 0; k < support::kSmallFrames; ++k) {
    int c = 0;
    for (const std::string& name : {colour, left, right}) {
      support::TestImage one = image(c > 0 ? c - 1 : 0, k);
      if (c++ == 0) one.data[0] = static_cast<char>(one.data[0] + 1);
      all.push_back({name, "sensor_msgs/Image", one.stamp_ns, support::image_message(Wire::kRos1, one)});
    }
  }
  write(all);
  const fs::path rig = folder_.path() / "rig.yaml";
  support::write_text(rig, rig_of("left", "right"));
  DatasetRequest request{.path = bag(), .rig_file = rig};
  const std::string expected = bag().string() + ": found image topics " + colour + ", " + left + ", " + right +
                               ", expected those of the 2 cameras of " + rig.string() +
                               " (left, right): name the topics in their order with --topics";
  const auto unclear = open_dataset(request);
  ASSERT_FALSE(unclear);
  EXPECT_EQ(unclear.error().message(), expected);
  EXPECT_EQ(describe_recording(request)->refusal, expected);
  request.cameras = {0};
  EXPECT_FALSE(open_dataset(request));
  request.cameras = {};
  request.topics = {left, right};
  const auto named = open_dataset(request);
  ASSERT_TRUE(named) << named.error().message();
  EXPECT_EQ(named->sources, (std::vector<std::string>{left, right}));
}

TEST_F(SmallBag, TopicsWithTheNamesOfTheCamerasAreFoundByThem) {
  std::vector<TestMessage> all = messages(Wire::kRos1);
  for (int k = 0; k < support::kSmallFrames; ++k) {
    support::TestImage one = image(0, k);
    one.data[0] = static_cast<char>(one.data[0] + 1);
    all.push_back({"/cam/image_raw", "sensor_msgs/Image", one.stamp_ns, support::image_message(Wire::kRos1, one)});
  }
  write(all);
  const fs::path rig = folder_.path() / "rig.yaml";
  support::write_text(rig, rig_of("cam1", "cam0"));
  const auto dataset = open_dataset({.path = bag(), .rig_file = rig});
  ASSERT_TRUE(dataset) << dataset.error().message();
  EXPECT_EQ(dataset->sources, (std::vector<std::string>{topic(1), topic(0)}));
  EXPECT_TRUE(dataset->sources_by_name);
  EXPECT_TRUE(has(dataset->warnings, "the additional cameras are not used"));
}

TEST_F(SmallBag, TopicsAreInTheNaturalOrderOfTheirNames) {
  std::vector<TestMessage> all = messages(Wire::kRos1);
  for (TestMessage& message : all)
    message.topic = message.topic == topic(0) ? "/stereo9/image_raw" : "/stereo10/image_raw";
  write(all);
  expect_same(request(bag()));
  EXPECT_EQ(open_dataset(request(bag()))->sources,
            (std::vector<std::string>{"/stereo9/image_raw", "/stereo10/image_raw"}));
}

TEST_F(SmallBag, CameraInfoOfAStereoPairIsItsCalibration) {
  auto all = messages(Wire::kRos1);
  add_calibration(all, Wire::kRos1, 20 * 0.11);
  write(all);
  const auto dataset = open_dataset({.path = bag()});
  ASSERT_TRUE(dataset) << dataset.error().message();
  EXPECT_EQ(dataset->rig.camera(std::size_t{0}).name, "cam0");
  EXPECT_NEAR((dataset->rig.body_from_cam(1).translation() - Eigen::Vector3d(0.11, 0, 0)).norm(), 0, 1e-9);
}

TEST_F(SmallBag, WithoutABaselineTheRigIsMissing) {
  auto all = messages(Wire::kRos1);
  add_calibration(all, Wire::kRos1, 0);
  write(all);
  const auto dataset = open_dataset({.path = bag()});
  ASSERT_FALSE(dataset);
  EXPECT_NE(dataset.error().message().find("--rig"), std::string::npos) << dataset.error().message();
  DatasetRequest one{.path = bag()};
  one.topics = {topic(1)};
  EXPECT_TRUE(open_dataset(one)) << open_dataset(one).error().message();
}

TEST_F(SmallBag, AnotherSizeThanTheCalibrationIsAnError) {
  auto all = messages(Wire::kRos1);
  add_calibration(all, Wire::kRos1, 2);
  support::TestImage small = image(0, 0);
  small.width = small.step = 16;
  for (TestMessage& message : all) {
    if (message.topic == topic(0)) message.bytes = support::image_message(Wire::kRos1, small);
  }
  write(all);
  const auto own = open_dataset({.path = bag()}), given = open_dataset(request(bag()));
  ASSERT_FALSE(own);
  EXPECT_NE(own.error().message().find("16x24"), std::string::npos) << own.error().message();
  ASSERT_FALSE(given);
  EXPECT_EQ(given.error().found, "images of 16x24 pixels");
}

TEST_F(SmallBag, TimesOfTheHeadersThatGoBackAreSorted) {
  auto all = messages(Wire::kRos1);
  std::swap(all[10].bytes, all[14].bytes);
  all[20].bytes = all[18].bytes;
  write(all);
  const auto dataset = open_dataset(request(bag()));
  ASSERT_TRUE(dataset) << dataset.error().message();
  EXPECT_TRUE(has(dataset->warnings,
                  "time stamps step back 2 times, first from 1000.350000000 s to 1000.300000000 s; "
                  "images have been sorted"));
  EXPECT_TRUE(has(dataset->warnings, "1 images with the time stamp of another"));
}

TEST_F(SmallBag, DepthImagesAreNoCameraBesideOthers) {
  std::vector<TestMessage> all = messages(Wire::kRos1), depth;
  for (int k = 0; k < support::kSmallFrames; ++k) {
    support::TestImage one = image(0, k);
    one.encoding = "16UC1";
    one.step = 2 * one.width;
    one.data += one.data;
    depth.push_back({"/a/Depth/image", "sensor_msgs/Image", one.stamp_ns, support::image_message(Wire::kRos1, one)});
  }
  all.insert(all.begin(), depth.begin(), depth.end());
  write(all);
  const auto both = open_dataset(request(bag()));
  ASSERT_TRUE(both) << both.error().message();
  EXPECT_EQ(both->sources, (std::vector<std::string>{topic(0), topic(1)}));
  EXPECT_TRUE(has(both->warnings, "/a/Depth/image is not used: depth images; --topics can name it"));
  DatasetRequest named = request(bag());
  named.topics = {"/a/Depth/image"};
  named.cameras = {0};
  EXPECT_TRUE(open_dataset(named));
  write(depth);
  named.topics.clear();
  EXPECT_TRUE(open_dataset(named));  // they are all that there is
}

TEST_F(SmallBag, TheSameTopicUnderTwoNamesIsRefused) {
  auto all = messages(Wire::kRos1);
  for (std::size_t m = 1; m < all.size(); m += 2) all[m].bytes = all[m - 1].bytes;
  write(all);
  const auto dataset = open_dataset(request(bag()));
  ASSERT_FALSE(dataset);
  EXPECT_TRUE(dataset.error().found.starts_with("the same images as in ")) << dataset.error().message();
}

TEST_F(SmallBag, DescriptionsSayWhichImagesCannotBeDecoded) {
  for (const int k : {0, support::kSmallFrames - 1})
    support::write_text(data() / "mav0/cam1/data" / support::small_image_name(k), "damaged");
  const auto described = describe_recording({.path = data()});
  ASSERT_TRUE(described);
  EXPECT_TRUE(described->streams[0].notes.empty());
  EXPECT_TRUE(has(described->streams[1].notes, "2 of 5 images that were tried cannot be decoded, the first: "));
}

// The clock of the recording computer was set back, and with it the times of recording.
TEST_F(SmallBag, TimesThatTheClockPassesTwiceAreNotMixed) {
  constexpr int kBefore = 12, kStep = 5;
  std::vector<TestMessage> all;
  for (int k = 0; k < support::kSmallFrames; ++k) {
    for (int c = 0; c < 2; ++c) {
      support::TestImage one = image(c, k);
      if (k >= kBefore) one.stamp_ns -= kStep * support::kSmallInterval - support::kSmallInterval / 3;
      all.push_back(
          {topic(c), "sensor_msgs/Image", one.stamp_ns + 3'000'000, support::image_message(Wire::kRos1, one)});
    }
  }
  write(all);
  const auto dataset = open_dataset(request(bag()));
  ASSERT_TRUE(dataset) << dataset.error().message();
  EXPECT_TRUE(has(dataset->warnings,
                  "the clock was set back during the recording; 4 images with times that had been "
                  "before are not used"));
  EXPECT_EQ(dataset->frames.size(), support::kSmallFrames - 4u);
}

TEST_F(SmallBag, WithoutStampsTheTimesOfRecordingAreUsed) {
  auto all = messages(Wire::kRos1);
  for (std::size_t m = 0; m < all.size(); ++m) {
    support::TestImage one = image(static_cast<int>(m % 2), static_cast<int>(m / 2));
    one.stamp_ns = 0;
    all[m].bytes = support::image_message(Wire::kRos1, one);
  }
  write(all);
  const auto dataset = open_dataset(request(bag()));
  ASSERT_TRUE(dataset) << dataset.error().message();
  EXPECT_TRUE(has(dataset->warnings, "the times of recording are used"));
  EXPECT_EQ(dataset->first_time_ns, support::kSmallStart + 3'000'000);
}

// Writers of protocol buffers leave out what is not set.
TEST_F(SmallBag, WithoutStampsFoxgloveHasTheTimesOfRecording) {
  auto all = messages(Wire::kProtobuf);
  const fs::path file = folder_.path() / "a.mcap";
  for (TestMessage& message : all) {
    message.type = "foxglove.RawImage";
    message.bytes.erase(0, 2 + static_cast<std::size_t>(message.bytes[1]));  // field 1, the first
  }
  support::write_text(file, support::mcap_bytes(all, Wire::kProtobuf));
  const auto dataset = open_dataset(request(file));
  ASSERT_TRUE(dataset) << dataset.error().message();
  EXPECT_EQ(dataset->frames.size(), static_cast<std::size_t>(support::kSmallFrames));
  EXPECT_TRUE(has(dataset->warnings, "the times of recording are used"));
  EXPECT_FALSE(has(dataset->warnings, "damaged"));
  EXPECT_EQ(dataset->first_time_ns, support::kSmallStart + 3'000'000);
  EXPECT_EQ(read_frame(*dataset, 3).images[1].image.row(0)[5], static_cast<std::uint8_t>(pixels(1, 3)[5]));
  all[4].bytes.resize(all[4].bytes.size() / 2);
  support::write_text(file, support::mcap_bytes(all, Wire::kProtobuf));
  EXPECT_TRUE(has(open_dataset(request(file))->warnings, "1 messages are damaged"));
}

TEST_F(SmallBag, ImagesWithoutAStampAreNeitherUsedNorDescribed) {
  auto all = messages(Wire::kRos1);
  support::TestImage one = image(0, 2);
  one.stamp_ns = 0;
  all[4].bytes = support::image_message(Wire::kRos1, one);
  write(all);
  const auto dataset = open_dataset(request(bag()));
  ASSERT_TRUE(dataset) << dataset.error().message();
  EXPECT_TRUE(has(dataset->warnings, "1 images without a time stamp"));
  const auto described = describe_recording({.path = bag()});
  ASSERT_TRUE(described) << described.error().message();
  const StreamDescription& first = described->streams[0];
  EXPECT_EQ(first.count, static_cast<std::uint64_t>(support::kSmallFrames));
  ASSERT_EQ(first.times.size(), static_cast<std::size_t>(support::kSmallFrames - 1));
  EXPECT_EQ(first.times.front(), support::kSmallStart);
  EXPECT_EQ(first.notes,
            (std::vector<std::string>{"1 images have no time stamp",
                                      "1 image is missing at 20.0 Hz, the first 0.050 s after its first image"}));
}

TEST_F(SmallBag, TheDescriptionNamesCamerasTimesAndWhatIsMissing) {
  auto all = messages(Wire::kRos1);
  all.push_back({"/depth", "sensor_msgs/Image", support::kSmallStart,
                 support::image_message(Wire::kRos1, {support::kSmallStart, 2, 1, 8, "32FC1", std::string(8, 'x')})});
  all.push_back({"/imu", "sensor_msgs/Imu", support::kSmallStart, "imu"});
  write(all);
  const auto described = describe_recording({.path = bag()});
  ASSERT_TRUE(described) << described.error().message();
  EXPECT_EQ(described->format, "ROS 1 bag");
  ASSERT_EQ(described->streams.size(), 4u);
  const StreamDescription& first = described->streams[0];
  EXPECT_EQ(first.name, topic(0));
  EXPECT_EQ(first.camera, 0);
  EXPECT_EQ(first.count, static_cast<std::uint64_t>(support::kSmallFrames));
  EXPECT_EQ(first.width, support::kSmallWidth);
  EXPECT_EQ(first.encoding, "mono8");
  EXPECT_EQ(first.stamps, "header");
  ASSERT_TRUE(first.lag);
  EXPECT_NEAR(first.lag->median, 0.003, 1e-9);
  EXPECT_EQ(described->streams[2].name, "/depth");
  EXPECT_EQ(described->streams[2].camera, -1);
  EXPECT_EQ(described->streams[2].unused, "encoding 32FC1 is not supported");
  EXPECT_EQ(described->streams[3].count, 1u);
  ASSERT_EQ(described->synchrony.size(), 1u);
  EXPECT_EQ(described->synchrony[0].together, static_cast<std::size_t>(support::kSmallFrames));
  ASSERT_EQ(described->missing.size(), 1u);
  EXPECT_NE(described->missing[0].find("--rig FILE"), std::string::npos);
  // Folders are described, too.
  const auto folder = describe_recording({.path = data()});
  ASSERT_TRUE(folder);
  EXPECT_EQ(folder->streams.size(), 2u);
  EXPECT_TRUE(folder->missing.empty());
}

TEST(CameraInfo, ChecksWhatItCannotRepresent) {
  containers::CameraInfo info;
  info.width = 640;
  info.height = 480;
  info.distortion_model = "equidistant";
  info.K = {300, 0, 320, 0, 301, 240, 0, 0, 1};
  info.distortion = {0.1, 0.01, 0.001, 0.0001};
  ASSERT_TRUE(camera_of(info, "a", "/info"));
  EXPECT_EQ(camera::model_name(camera_of(info, "a", "/info")->camera.model), "kannala-brandt");
  const auto key = [&](const std::function<void(containers::CameraInfo&)>& change) {
    containers::CameraInfo changed = info;
    change(changed);
    const auto camera = camera_of(changed, "a", "/info");
    return camera ? std::string() : camera.error().key;
  };
  EXPECT_EQ(key([](auto& i) { i.K[0] = 0; }), "K");
  EXPECT_EQ(key([](auto& i) { i.binning_x = 2; }), "binning");
  EXPECT_EQ(key([](auto& i) { i.roi_x = 8; }), "roi");
  EXPECT_EQ(key([](auto& i) { i.distortion_model = "omni"; }), "distortion_model");
  EXPECT_EQ(key([](auto& i) { i.distortion.push_back(1); }), "D");
  info.distortion_model = "rational_polynomial";
  info.distortion = {0.1, 0.01, 0.001, 0.0001, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0};
  ASSERT_TRUE(camera_of(info, "a", "/info"));
  EXPECT_EQ(camera::distortion(camera_of(info, "a", "/info")->camera.model).size(), 8u);
}

}  // namespace
}  // namespace bslam::dataset
