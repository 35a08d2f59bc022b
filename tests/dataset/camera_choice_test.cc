// Which recorded images are those of which camera of a rig file, for layouts whose folders have numbers.
#include <gtest/gtest.h>

#include <map>

#include "dataset/dataset.h"
#include "dataset/recording_description.h"
#include "rig_formats/euroc_sensor.h"
#include "rig_formats/rig_file.h"
#include "support/bag_writer.h"
#include "support/data_on_disk.h"

namespace bslam::dataset {
namespace {

namespace fs = std::filesystem;

// Recordings of images of 32 x 24 pixels.
class RecordedCamerasOf : public testing::Test {
 protected:
  void write_euroc(const std::vector<int>& cameras) const {
    support::write_small_euroc(folder_.path() / "all", 4);
    for (const int camera : cameras) {
      const fs::path name = fs::path("mav0") / ("cam" + std::to_string(camera));
      fs::create_directories((data() / name).parent_path());
      fs::rename(folder_.path() / "all" / name, data() / name);
    }
    fs::remove_all(folder_.path() / "all");
  }
  void write_kitti(const std::vector<int>& cameras) const {
    support::write_text(data() / "times.txt", "0.0\n0.1\n0.2\n0.3\n");
    for (const int camera : cameras) {
      for (int k = 0; k < 4; ++k)
        support::write_image(data() / ("image_" + std::to_string(camera)) / ("00000" + std::to_string(k) + ".png"), 32,
                             24, 100 * camera + k);
    }
  }
  static std::string rig_text(const std::vector<std::string>& names) {
    std::string text = "bslam_rig: 1\ncameras:\n";
    for (const std::string& name : names) {
      text += "  - name: " + name +
              "\n    model: pinhole\n    resolution: [32, 24]\n    intrinsics: [20, 20, 15.5, 11.5]\n"
              "    T_body_cam: [[1, 0, 0, 0.1], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]\n";
    }
    return text;
  }
  Result<Dataset> open(const std::vector<std::string>& rig, std::vector<int> cameras = {},
                       std::vector<std::string> topics = {}) const {
    const fs::path file = folder_.path() / "rig.yaml";
    support::write_text(file, rig_text(rig));
    return open_dataset({.path = data(), .rig_file = file, .topics = std::move(topics), .cameras = std::move(cameras)});
  }
  // The folder of every camera in use, or the error.
  std::string folders(const std::vector<std::string>& rig, std::vector<int> cameras = {}) const {
    const auto dataset = open(rig, std::move(cameras));
    if (!dataset) return dataset.error().message();
    std::string text;
    for (const std::string& source : dataset->sources) {
      text += (text.empty() ? "" : " ") + fs::path(source).lexically_relative(data()).generic_string();
    }
    return text;
  }
  std::string refusal(const std::string& found, const std::string& expected) const {
    return data().string() + ": found " + found + ", expected " + expected;
  }
  fs::path data() const { return folder_.path() / "recording"; }
  std::string rig_file() const { return (folder_.path() / "rig.yaml").string(); }

  support::TemporaryFolder folder_;
};

TEST_F(RecordedCamerasOf, EurocAreThoseWithTheNamesOfTheRig) {
  write_euroc({0, 1, 2});
  EXPECT_EQ(folders({"cam1", "cam2"}), "mav0/cam1/data mav0/cam2/data");
  EXPECT_EQ(folders({"cam2", "cam0"}, {0}), "mav0/cam2/data");
  EXPECT_EQ(folders({"left", "right"}), "mav0/cam0/data mav0/cam1/data");
  EXPECT_EQ(folders({"cam0", "right"}), "mav0/cam0/data mav0/cam1/data");
  EXPECT_EQ(folders({"a", "b", "c"}), "mav0/cam0/data mav0/cam1/data mav0/cam2/data");
  EXPECT_EQ(folders({"cam2", "cam3"}),
            refusal("images of cam2", "images of camera 1 (cam3) as well, since " + rig_file() +
                                          " has 2 cameras; --cameras 0 selects those that it has"));
}

TEST_F(RecordedCamerasOf, EurocAreThoseWithTheNumbersOfTheRig) {
  write_euroc({0, 2});
  for (const std::vector<std::string>& rig :
       {std::vector<std::string>{"cam0", "cam1", "cam2"}, std::vector<std::string>{"left", "middle", "right"}}) {
    EXPECT_EQ(folders(rig, {0, 2}), "mav0/cam0/data mav0/cam2/data");
    EXPECT_EQ(folders(rig, {2}), "mav0/cam2/data");
    const std::string refused = refusal("images of " + rig[0] + ", " + rig[2],
                                        "images of camera 1 (" + rig[1] + ") as well, since " + rig_file() +
                                            " has 3 cameras; --cameras 0,2 selects those that it has");
    EXPECT_EQ(folders(rig), refused);
    EXPECT_EQ(folders(rig, {1}), refused);
    EXPECT_EQ(folders(rig, {0, 1}), refused);
  }
  EXPECT_EQ(folders({"left", "right"}), "mav0/cam0/data mav0/cam2/data");
  EXPECT_EQ(folders({"left"}),
            refusal("images of the cameras with the numbers 0, 2",
                    "those of the cameras of " + rig_file() +
                        " (left): call these like their folders, or give the calibration of all cameras up to the "
                        "largest number"));
}

// The folders of bslam simulate have the numbers of the cameras, whatever their names.
TEST_F(RecordedCamerasOf, ASimulationHaveTheNamesOfItsRig) {
  write_euroc({0, 1});
  support::write_text(data() / rig_formats::kComplete, "");
  support::write_text(data() / "rig.yaml", rig_text({"cam1", "cam0"}));
  EXPECT_EQ(folders({"cam1", "cam0"}), "mav0/cam0/data mav0/cam1/data");
  EXPECT_EQ(folders({"cam0"}), "mav0/cam1/data");
}

TEST_F(RecordedCamerasOf, KittiAreThoseWithTheNamesOrNumbersOfTheRig) {
  write_kitti({0, 1, 2, 3});
  EXPECT_EQ(folders({"image_2", "image_3"}), "image_2 image_3");
  EXPECT_EQ(folders({"left", "right"}), "image_0 image_1");
  EXPECT_EQ(folders({"a", "b", "c", "d"}, {3, 2}), "image_3 image_2");
  for (const char* grey : {"image_0", "image_1"}) fs::remove_all(data() / grey);
  EXPECT_EQ(folders({"image_2", "image_3"}), "image_2 image_3");
  EXPECT_EQ(folders({"left", "right"}), "image_2 image_3");
  EXPECT_EQ(folders({"left", "right"}, {1}), "image_3");
  EXPECT_EQ(folders({"a", "b", "c", "d"}, {2, 3}), "image_2 image_3");
  EXPECT_NE(folders({"a", "b", "c", "d"}, {0, 1}).find("--cameras 2,3 selects those that it has"), std::string::npos);
}

TEST_F(RecordedCamerasOf, PlainFoldersAreThoseWithTheNumbersOfTheRig) {
  write_euroc({0, 2});
  for (const char* name : {"cam0", "cam2"}) fs::rename(data() / "mav0" / name / "data", data() / name);
  fs::remove_all(data() / "mav0");
  EXPECT_EQ(folders({"left", "middle", "right"}, {0, 2}), "cam0 cam2");
  EXPECT_NE(folders({"left", "middle", "right"}, {0, 1}).find("--cameras 0,2 selects"), std::string::npos);
  EXPECT_NE(folders({"cam0", "cam1"}).find("--cameras 0 selects"), std::string::npos);
  EXPECT_EQ(folders({"front", "rear"}), "cam0 cam2");
}

// Topics say nothing about the numbers of their cameras.
class TopicsOfABag : public RecordedCamerasOf {
 protected:
  void write(const std::vector<std::string>& topics) {
    std::vector<support::TestMessage> messages;
    for (int k = 0; k < 4; ++k) {
      for (std::size_t c = 0; c < topics.size(); ++c) {
        const TimeNs time_ns = support::kSmallStart + k * support::kSmallInterval;
        const std::string pixels(std::size_t{32} * 24, static_cast<char>(10 * c + static_cast<std::size_t>(k)));
        messages.push_back({topics[c], "sensor_msgs/Image", time_ns,
                            support::image_message(support::Wire::kRos1, {time_ns, 32, 24, 32, "mono8", pixels})});
      }
    }
    support::write_text(data(), support::rosbag1_bytes(messages));
  }
  const std::vector<std::string> rig_ = {"a", "b", "c", "d"};
};

TEST_F(TopicsOfABag, AreAskedForIfNotTheFirstCamerasAreSelected) {
  write({"/x/image_raw", "/y/image_raw"});
  const std::string start = "images of camera 2 (c) as well, since " + rig_file() + " has 4 cameras; ";
  EXPECT_EQ(open(rig_).error().message(), refusal("images of 2 cameras", start + "--cameras selects a subset"));
  EXPECT_EQ(open(rig_, {2, 3}).error().message(),
            refusal("images of 2 cameras", start + "--topics names the images of the selected cameras in their order"));
  EXPECT_EQ(open(rig_, {2}, {"/y/image_raw", "/x/image_raw"}).error().message(),
            refusal("images of 2 cameras", start + "--cameras selects as many as there are images of, in their order"));
  const auto named = open(rig_, {2, 3}, {"/y/image_raw", "/x/image_raw"});
  ASSERT_TRUE(named) << named.error().message();
  EXPECT_EQ(named->rig.camera(0u).name, "c");
  EXPECT_EQ(named->sources, (std::vector<std::string>{"/y/image_raw", "/x/image_raw"}));
}

TEST_F(TopicsOfABag, MayBeOneOfAnyCamera) {
  write({"/x/image_raw"});
  const auto dataset = open(rig_, {2});
  ASSERT_TRUE(dataset) << dataset.error().message();
  EXPECT_EQ(dataset->rig.camera(0u).name, "c");
}

TEST_F(TopicsOfABag, AreNotTakenInTheirOrderIfOneHasTheNameOfACamera) {
  write({"/a/image_raw", "/x/image_raw"});
  EXPECT_EQ(open({"x", "left"}).error().message(),
            refusal("images of x", "images of camera 1 (left) as well, since " + rig_file() +
                                       " has 2 cameras; --cameras 0 selects those that it has, and --topics names the "
                                       "topics of all cameras in their order"));
}

// A Kalibr camchain, whose cameras are always called cam0, cam1, ... and have the topics of the calibration.
class TopicsOfACamchain : public TopicsOfABag {
 protected:
  using Topics = std::vector<std::string>;
  Result<Dataset> open_with(const Topics& rostopics, std::vector<int> cameras = {}, Topics requested = {}) const {
    std::string text;
    for (std::size_t c = 0; c < rostopics.size(); ++c) {
      text += "cam" + std::to_string(c) +
              ":\n  camera_model: pinhole\n  intrinsics: [20, 20, 15.5, 11.5]\n  resolution: [32, 24]\n";
      if (!rostopics[c].empty()) text += "  rostopic: " + rostopics[c] + "\n";
      if (c > 0) text += "  T_cn_cnm1: [[1, 0, 0, -0.1], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]\n";
    }
    support::write_text(rig_file(), text);
    return open_dataset(
        {.path = data(), .rig_file = rig_file(), .topics = std::move(requested), .cameras = std::move(cameras)});
  }
  Topics sources(const Topics& rostopics, std::vector<int> cameras = {}, Topics requested = {}) const {
    const auto dataset = open_with(rostopics, std::move(cameras), std::move(requested));
    if (!dataset) return {dataset.error().message()};
    EXPECT_EQ(dataset->warnings, Topics());
    return dataset->sources;
  }
  // The topics, and the reason why those of the camchain are not used.
  void expect_unused(const Topics& rostopics, const Topics& used, const std::string& reason) const {
    const auto dataset = open_with(rostopics);
    ASSERT_TRUE(dataset) << dataset.error().message();
    EXPECT_EQ(dataset->sources, used);
    EXPECT_FALSE(dataset->sources_by_topic);
    EXPECT_EQ(dataset->warnings, Topics{rig_file() + ": the topics that it names for its cameras are not used, since " +
                                        reason + "; choose with --topics"});
  }
};

TEST_F(TopicsOfACamchain, AreThoseOfItsCameras) {
  const Topics crossed = {"/zfront/image_raw", "/aside/image_raw"};
  write(crossed);
  EXPECT_EQ(sources(crossed), crossed);
  EXPECT_TRUE(open_with(crossed)->sources_by_topic);
  EXPECT_EQ(sources(crossed, {1}), Topics{crossed[1]});
  EXPECT_EQ(sources({"zfront/image_raw/compressed", "/aside/image_raw"}), crossed);
  EXPECT_EQ(sources({"/other/image_raw", crossed[1], crossed[0]}, {2, 1}), crossed);
  EXPECT_EQ(sources(crossed, {}, {crossed[1], crossed[0]}), (Topics{crossed[1], crossed[0]}));
  const auto described = describe_recording({.path = data(), .rig_file = rig_file()});
  for (const StreamDescription& stream : described->streams)
    EXPECT_EQ(stream.camera, stream.name == crossed[0] ? 0 : 1) << stream.name;
}

TEST_F(TopicsOfACamchain, CountMoreThanNamesAndLeaveOutOtherTopics) {
  const Topics crossed = {"/cam1/image_raw", "/cam0/image_raw"};
  write({"/cam0/image_raw", "/cam1/image_raw"});
  EXPECT_EQ(sources(crossed), crossed);
  write({"/cam0/image_raw", "/cam1/image_raw", "/colour/image_raw"});
  EXPECT_EQ(open_with({"/colour/image_raw", "/cam1/image_raw"})->sources,
            (Topics{"/colour/image_raw", "/cam1/image_raw"}));
}

TEST_F(TopicsOfACamchain, AreIgnoredIfTheRecordingHasOthersAndAWarningSaysIfItHasSome) {
  const Topics recorded = {"/x/image_raw", "/y/image_raw"};
  write(recorded);
  EXPECT_EQ(sources({"/b/image_raw", "/a/image_raw"}), recorded);
  EXPECT_EQ(sources({"", ""}), recorded);
  expect_unused({"/y/image_raw", "/a/image_raw"}, recorded, "the recording has no images of /a/image_raw");
  expect_unused({"/y/image_raw", ""}, recorded, "it names none for cam1");
  expect_unused({"/y/image_raw", "/y/image_raw"}, recorded, "it names /y/image_raw for more than one camera");
}

TEST_F(TopicsOfACamchain, AreKeptByTheFormatOfBslam) {
  const Topics crossed = {"/zfront/image_raw", "/aside/image_raw"};
  write(crossed);
  ASSERT_TRUE(open_with(crossed));
  const auto file = rig_formats::read_rig_file(rig_file());
  support::write_text(rig_file(), rig_formats::rig_to_yaml(file->rig, file->topics));
  EXPECT_EQ(open_dataset({.path = data(), .rig_file = rig_file()})->sources, crossed);
}

}  // namespace
}  // namespace bslam::dataset
