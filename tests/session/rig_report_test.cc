#include "session/rig_report.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "calibration/convention_check.h"
#include "calibration/late_camera.h"
#include "calibration/rig_warnings.h"
#include "camera/stereo_rig.h"
#include "containers/mcap_writer.h"
#include "containers/ros_writer.h"
#include "dataset/frame_reader.h"
#include "dataset/live_recording.h"
#include "rig_formats/bslam_rig.h"
#include "rig_formats/rig_file.h"
#include "session/rig_source.h"
#include "simulator/simulation_writer.h"
#include "storage/small_map.h"
#include "support/bag_writer.h"
#include "support/data_on_disk.h"
#include "synthetic/rigs.h"

namespace bslam::session {
namespace {

namespace fs = std::filesystem;

class RigReport : public testing::Test {
 protected:
  RigReport() : folder_(fs::temp_directory_path() / ("bslam_rig_report_" + std::to_string(::getpid()))) {
    fs::create_directories(folder_);
  }
  ~RigReport() override { fs::remove_all(folder_); }
  fs::path folder_;
};

TEST_F(RigReport, IsTextOrJson) {
  std::vector<camera::RigCamera> cameras;
  for (std::size_t i = 0; i < 2; ++i) {
    cameras.push_back({camera::stereo_rig().camera(i), camera::stereo_rig().body_from_cam(i)});
    cameras.back().camera.name = "eye" + std::to_string(i);
  }
  ASSERT_TRUE(rig_formats::write_rig(camera::Rig(cameras), folder_ / "rig.yaml"));
  const auto text = report_rig({.file = (folder_ / "rig.yaml").string()});
  ASSERT_TRUE(text);
  EXPECT_NE(text->find("camera 1: eye1"), std::string::npos);
  const auto json = report_rig({.file = (folder_ / "rig.yaml").string(), .json = true});
  const auto parsed = nlohmann::json::parse(*json);
  EXPECT_EQ(parsed["format"], "bslam");
  EXPECT_EQ(parsed["cameras"][1]["name"], "eye1");
  EXPECT_NEAR(parsed["cameras"][1]["position_cam0"][0].get<double>(), 0.12, 1e-9);
  EXPECT_NEAR(parsed["baselines"][0]["length_m"].get<double>(), std::sqrt(0.12 * 0.12 + 2e-4), 1e-9);
  EXPECT_TRUE(parsed["warnings"].empty());
  EXPECT_FALSE(report_rig({.file = (folder_ / "none.yaml").string()}));
}

TEST_F(RigReport, OfASavedMapShowsItsCameras) {
  const std::string file = (folder_ / "map.bmap").string();
  const camera::Rig rig = synthetic::ring_rig(3);
  ASSERT_TRUE(storage::write_map(storage::small_map(rig), storage::small_info(), file));
  const auto parsed = nlohmann::json::parse(report_rig({.file = file, .json = true}).value());
  EXPECT_EQ(parsed["format"], "saved map");
  ASSERT_EQ(parsed["cameras"].size(), 3u);
  EXPECT_EQ(parsed["cameras"][2]["name"], rig.camera(2).name);
  const auto with_images = report_rig({.file = file, .images = folder_.string()});
  ASSERT_FALSE(with_images);
}

TEST_F(RigReport, JsonOfANameThatIsNoUnicodeCanBeRead) {
  camera::RigCamera camera{camera::stereo_rig().camera(0u), camera::stereo_rig().body_from_cam(0)};
  camera.camera.name = "left";
  ASSERT_TRUE(rig_formats::write_rig(camera::Rig({camera}), folder_ / "rig.yaml"));
  std::string text = support::read_text(folder_ / "rig.yaml");
  support::write_text(folder_ / "rig.yaml", text.replace(text.find("left"), 4, "caf\xe9"));
  const auto json = report_rig({.file = (folder_ / "rig.yaml").string(), .json = true});
  ASSERT_TRUE(json) << json.error().message();
  EXPECT_EQ(nlohmann::json::parse(*json)["cameras"][0]["name"], "caf\ufffd");
}

TEST_F(RigReport, WarnsOfAnUnusableMask) {
  camera::RigCamera camera{camera::stereo_rig().camera(0u), camera::stereo_rig().body_from_cam(0)};
  camera.camera.mask_file = (folder_ / "none.png").string();
  ASSERT_TRUE(rig_formats::write_rig(camera::Rig({camera}), folder_ / "rig.yaml"));
  const auto text = report_rig({.file = (folder_ / "rig.yaml").string()});
  ASSERT_TRUE(text);
  EXPECT_NE(text->find("warning: mask of "), std::string::npos) << *text;
  EXPECT_NE(text->find("none.png"), std::string::npos) << *text;
}

TEST_F(RigReport, DescribesTheCalibrationOfABag) {
  std::vector<support::TestMessage> messages;
  for (int c = 0; c < 2; ++c) {
    const std::string topic = "/cam" + std::to_string(c);
    const support::TestCalibration info{32,
                                        24,
                                        "plumb_bob",
                                        {0, 0, 0, 0, 0},
                                        {20, 0, 15.5, 0, 20, 11.5, 0, 0, 1},
                                        {1, 0, 0, 0, 1, 0, 0, 0, 1},
                                        {20, 0, 15.5, c == 0 ? 0 : -20 * 0.11, 0, 20, 11.5, 0, 0, 0, 1, 0}};
    const support::TestImage image{1'000'000'000, 32, 24, 32, "mono8", std::string(32 * 24, 'x')};
    messages.push_back({topic + "/camera_info", "sensor_msgs/CameraInfo", 1'000'000'000,
                        support::calibration_message(support::Wire::kRos1, info)});
    messages.push_back({topic + "/image_raw", "sensor_msgs/Image", 1'000'000'000,
                        support::image_message(support::Wire::kRos1, image)});
  }
  const fs::path bag = folder_ / "small.bag";
  support::write_text(bag, support::rosbag1_bytes(messages));
  const auto text = report_rig({.file = bag.string()});
  ASSERT_TRUE(text) << text.error().message();
  EXPECT_NE(text->find("format: CameraInfo of a bag\n2 cameras\n"), std::string::npos) << *text;
  EXPECT_NE(text->find("11.0 cm"), std::string::npos) << *text;
  // As a file, it can be written in another format.
  const auto source = read_rig_source({.path = bag});
  ASSERT_TRUE(source && source->of_recording);
  EXPECT_NEAR(source->file.rig.rig_from_cam(1).translation().x(), 0.11, 1e-9);
  EXPECT_EQ(read_rig_source({.path = bag, .topics = {"/cam1/image_raw"}})->file.rig.size(), 1u);
  // The recording of a live run has its rig as an attachment.
  const fs::path recording = folder_ / "live.mcap";
  auto writer = *containers::McapWriter::create(recording);
  const camera::Rig rig = synthetic::ring_rig(1, 32);
  ASSERT_TRUE(writer->attach(dataset::kLiveRigFile, "application/yaml", rig_formats::rig_to_yaml(rig)));
  ASSERT_TRUE(writer->add_metadata(dataset::kLiveMetadata, dataset::live_metadata({"/cam0/image_raw"}, {0})));
  writer->add_topic("/cam0/image_raw", containers::kImageType, containers::image_definition());
  const camera::Camera& camera = rig.camera(0u);
  const std::vector<std::uint8_t> pixels(static_cast<std::size_t>(camera.width * camera.height), 9);
  ASSERT_TRUE(writer->write(0, 1'000'000'000,
                            containers::grey_image_message(1'000'000'000, "camera", camera.width, camera.height,
                                                           pixels.data(), camera.width)));
  ASSERT_TRUE(writer->finish());
  const auto of_live = report_rig({.file = recording.string()});
  ASSERT_TRUE(of_live) << of_live.error().message();
  EXPECT_NE(of_live->find("format: rig of bslam live in its recording\n1 camera"), std::string::npos) << *of_live;
  messages.resize(1);  // a bag without images
  support::write_text(bag, support::rosbag1_bytes(messages));
  EXPECT_FALSE(report_rig({.file = bag.string()}));
  EXPECT_NE(read_rig_source({.path = bag}).error().message().find("no image topic"), std::string::npos);
}

// Renders 0.4 s of two cameras that look ahead.
auto render_pair(const std::filesystem::path& folder, double rate_hz) {
  ThreadPool pool(2);
  const simulator::SimulationRequest request{.folder = folder,
                                             .rig = synthetic::ring_rig(2, 240),
                                             .recording = {.duration_s = 0.4, .rate_hz = rate_hz},
                                             .tour = {.duration_s = 0.4},
                                             .imaging = {},
                                             .world = {.texel = 0.03, .light_texel = 0.8, .ambient_rays = 2}};
  return simulator::write_simulation(request, pool);
}

// Frames with images of both cameras are chosen for the test, wherever they are.
TEST_F(RigReport, TestsACameraThatHasFewImages) {
  ASSERT_TRUE(render_pair(folder_ / "data", 40).ok());
  std::vector<std::filesystem::path> images;
  for (const auto& file : std::filesystem::recursive_directory_iterator(folder_ / "data/mav0/cam1")) {
    if (file.path().extension() == ".png") images.push_back(file.path());
  }
  std::ranges::sort(images);
  ASSERT_EQ(images.size(), 16u);
  const std::string kept = images[5].stem().string();
  support::write_text(folder_ / "data/mav0/cam1/data.csv", "#timestamp [ns],filename\n" + kept + "," + kept + ".png\n");
  const std::string data = (folder_ / "data").string();
  const auto report = report_rig({.file = data, .images = data});
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_NE(report->find("the extrinsics are consistent with the images"), std::string::npos) << *report;
}

// The complete test: images, features, verdict.
TEST_F(RigReport, TestsTheExtrinsicsAgainstImages) {
  ASSERT_TRUE(render_pair(folder_ / "data", 10).ok());
  const std::string images = (folder_ / "data").string();
  const auto good = report_rig({.file = images, .images = images});
  ASSERT_TRUE(good) << good.error().message();
  EXPECT_NE(good->find("the extrinsics are consistent with the images"), std::string::npos) << *good;
  const camera::Rig rig = rig_formats::read_rig(images).value();
  ASSERT_TRUE(rig_formats::write_rig(calibration::with_inverse_extrinsics(rig), folder_ / "wrong.yaml"));
  const auto wrong = report_rig({.file = (folder_ / "wrong.yaml").string(), .images = images});
  EXPECT_NE(wrong->find("they are consistent with"), std::string::npos) << *wrong;
  std::vector<camera::RigCamera> late{{rig.camera(0u), rig.body_from_cam(0)}, {rig.camera(1u), rig.body_from_cam(1)}};
  late[1].camera.time_offset_ns = 15'000'000;
  ASSERT_TRUE(rig_formats::write_rig(camera::Rig(late), folder_ / "late.yaml"));
  const auto apart = report_rig({.file = (folder_ / "late.yaml").string(), .images = images});
  ASSERT_TRUE(apart) << apart.error().message();
  EXPECT_NE(apart->find("no images taken at the same time"), std::string::npos) << *apart;

  const auto data = dataset::open_dataset({.path = images});
  ASSERT_TRUE(data) << data.error().message();
  std::vector<image::ImageBundle> frames;
  for (std::size_t k = 0; k < data->frames.size(); ++k) {
    image::Image& image = frames.emplace_back(dataset::read_frame(*data, k)).images[1].image;
    for (int y = 0; y < image.height(); ++y) std::reverse(image.row(y), image.row(y) + image.width());
  }
  const auto mirrored = calibration::check_conventions(rig, frames, std::vector<image::Image>(2));
  ASSERT_TRUE(mirrored[0].mirrored) << calibration::describe_evidence(mirrored);
  EXPECT_EQ(mirrored[0].mirrored->camera, 1u);
  EXPECT_NE(calibration::describe_evidence(mirrored).find("warning: the images of camera 1 are mirrored"),
            std::string::npos);

  // A mask belongs to the images as they are. One half of them is black, and the other half is masked.
  std::vector<image::Image> masks(2);
  const int width = rig.camera(1u).width, height = rig.camera(1u).height;
  masks[1] = image::Image(width, height);
  for (int y = 0; y < height; ++y) {
    std::fill_n(masks[1].row(y), width / 2, std::uint8_t{255});
    std::fill_n(masks[1].row(y) + width / 2, width - width / 2, std::uint8_t{0});
    for (image::ImageBundle& frame : frames) std::fill_n(frame.images[1].image.row(y), width / 2, std::uint8_t{0});
  }
  EXPECT_TRUE(calibration::check_conventions(rig, frames, std::vector<image::Image>(2))[0].mirrored);
  EXPECT_FALSE(calibration::check_conventions(rig, frames, masks)[0].mirrored);
}

// A camera loses a frame in the middle of a recording, and its further images are renumbered.
TEST_F(RigReport, ACameraThatBecomesLateIsFound) {
  constexpr std::size_t kTriples = 8;
  ThreadPool pool(2);
  const simulator::SimulationRequest request{.folder = folder_ / "data",
                                             .rig = synthetic::ring_rig(2, 240),
                                             .recording = {.duration_s = 2.5, .rate_hz = 10},
                                             .tour = {.duration_s = 2.5},
                                             .imaging = {},
                                             .world = {.texel = 0.03, .light_texel = 0.8, .ambient_rays = 2}};
  ASSERT_TRUE(simulator::write_simulation(request, pool).ok());
  const auto data = dataset::open_dataset({.path = folder_ / "data"});
  ASSERT_TRUE(data) << data.error().message();
  std::vector<image::ImageBundle> right, late;
  for (std::size_t k = 0; k < 3 * kTriples; ++k) {
    right.push_back(dataset::read_frame(*data, k));
    late.push_back(dataset::read_frame(*data, k));
    if (k >= 3 * kTriples / 2) late.back().images[1].image = dataset::read_frame(*data, k + 1).images[1].image;
  }
  const std::vector<image::Image> masks(2);
  EXPECT_FALSE(calibration::find_late_camera(data->rig, data->rig, right, masks));
  const auto found = calibration::find_late_camera(data->rig, data->rig, late, masks);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->part, "last half");
  EXPECT_TRUE(found->early);

  // Some images have wrong time stamps.
  constexpr TimeNs kWrong = 60'000'000;
  late.front().images[1].time_ns += kWrong;
  const auto despite = calibration::find_late_camera(data->rig, data->rig, late, masks);
  ASSERT_TRUE(despite);
  EXPECT_TRUE(despite->early);
  for (std::size_t k = 0; k < late.size(); k += 3) late[k].images[1].time_ns += kWrong;
  EXPECT_FALSE(calibration::find_late_camera(data->rig, data->rig, late, masks));
}

}  // namespace
}  // namespace bslam::session
