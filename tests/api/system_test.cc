#include <bslam/bslam.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <set>
#include <stdexcept>

#include "api/textured_wall.h"
#include "storage/map_file.h"
#include "support/data_on_disk.h"

namespace bslam {
namespace {

using support::TemporaryFolder;
using testing::TexturedWall;

constexpr int kFrames = 60;

Config sequential() {
  Config config;
  config.set_mode(Mode::kSequential);
  EXPECT_TRUE(config.set("features.per_image", "400"));
  return config;
}

System make_system(Startup startup = {}) {
  return System::create(TexturedWall::rig(), sequential(), std::move(startup)).value();
}

class PublicSystem : public ::testing::Test {
 protected:
  TexturedWall wall_;

  void process(System& system, int from, int to) {
    for (int k = from; k < to; ++k) {
      const auto frame = system.process(wall_.bundle(k));
      ASSERT_TRUE(frame) << frame.error().message();
    }
  }
};

TEST_F(PublicSystem, ReportsPoseAndVelocityInTheDocumentedFrames) {
  std::vector<CameraCalibration> cameras = {TexturedWall::calibration(0), TexturedWall::calibration(1)};
  for (CameraCalibration& c : cameras) {  // body axes: x forward, y left, z up
    Pose T_body_cam0;
    T_body_cam0.rotation = {-0.5, 0.5, -0.5, 0.5};
    c.T_body_cam = T_body_cam0 * c.T_body_cam;
  }
  Config exact = sequential();  // the wall is a plane, which tells little about the calibration
  ASSERT_TRUE(exact.set("calibration.refine", "false"));
  auto system = System::create(Rig::make(cameras).value(), exact).value();
  FrameResult last;
  for (int k = 0; k < kFrames; ++k) last = system.process(wall_.bundle(k)).value();
  ASSERT_TRUE(last.tracking());
  EXPECT_EQ(last.frame, kFrames - 1);
  EXPECT_EQ(last.scale, Scale::kMetric);
  EXPECT_EQ(last.time_ns, TexturedWall::kStart_ns + (kFrames - 1) * TexturedWall::kInterval_ns);
  const double travelled = TexturedWall::kSpeed * 0.05 * (kFrames - 1);
  EXPECT_NEAR(last.T_world_cam0.translation[0], travelled, 0.05);
  EXPECT_NEAR(last.T_world_cam0.translation[1], 0, 0.05);
  ASSERT_TRUE(last.velocity);
  EXPECT_NEAR(last.velocity->linear[0], 0, 0.1);
  EXPECT_NEAR(last.velocity->linear[1], -TexturedWall::kSpeed, 0.1);  // camera 0's right is the body's -y
  EXPECT_NEAR(last.velocity->linear[2], 0, 0.1);
  ASSERT_TRUE(last.covariance);
  for (std::size_t i = 0; i < 6; ++i) {
    const double deviation = std::sqrt((*last.covariance)[7 * i]);  // rad, then metres
    EXPECT_GT(deviation, 1e-6);
    EXPECT_LT(deviation, 0.05);
    for (std::size_t j = 0; j < i; ++j)
      EXPECT_NEAR((*last.covariance)[6 * i + j], (*last.covariance)[6 * j + i], 1e-12);
  }
  auto untested = System::create(Rig::make(cameras).value(), sequential()).value();
  FrameResult cautious;
  for (int k = 0; k < kFrames; ++k) cautious = untested.process(wall_.bundle(k)).value();
  EXPECT_EQ(cautious.T_world_cam0.translation, last.T_world_cam0.translation);
  EXPECT_GT((*cautious.covariance)[21], 2 * (*last.covariance)[21]);  // along the path: the scale
  const Pose through_odom = last.T_map_odom * last.T_odom_body;
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(through_odom.translation[i], last.T_world_body.translation[i], 1e-9);
  ASSERT_EQ(last.cameras.size(), 2u);
  EXPECT_EQ(last.cameras[1].state, CameraState::kOk);
  EXPECT_GT(last.cameras[1].inliers, 20);
  EXPECT_FALSE(last.stages.empty());
}

TEST_F(PublicSystem, TheMapCanBeReadSavedAndContinued) {
  const TemporaryFolder folder;
  const auto file = folder.path() / "map.bslam";
  auto system = make_system();
  process(system, 0, kFrames);
  ASSERT_TRUE(system.finish());
  ASSERT_TRUE(system.save_map(file));
  ASSERT_TRUE(system.save_map(file));  // an earlier map is replaced
  EXPECT_FALSE(system.save_map("/no/such/folder/map"));
  const auto notes = folder.path() / "notes.txt";
  std::ofstream(notes) << "precious";
  const Status refused = system.save_map(notes);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message().find("found an existing file of another kind"), std::string::npos);
  EXPECT_EQ(std::filesystem::file_size(notes), 8u);

  auto map = MapView::load(file);
  ASSERT_TRUE(map) << map.error().message();
  EXPECT_EQ(map->scale(), Scale::kMetric);
  EXPECT_EQ(map->rig().size(), 2u);
  ASSERT_EQ(map->submaps().size(), 1u);
  EXPECT_EQ(map->submaps()[0].keyframes, map->num_keyframes());
  const auto landmarks = map->landmarks();
  ASSERT_EQ(landmarks.size(), map->num_landmarks());
  std::vector<double> depths;
  for (const auto& l : landmarks) depths.push_back(l.position[2]);
  std::ranges::nth_element(depths, depths.begin() + static_cast<std::ptrdiff_t>(depths.size() / 2));
  EXPECT_NEAR(depths[depths.size() / 2], TexturedWall::kDepth, 0.1);
  const auto keyframes = map->keyframes();
  ASSERT_GE(keyframes.size(), 2u);
  EXPECT_EQ(keyframes[0].parent, -1);
  EXPECT_FALSE(map->covisibility(1).empty());

  const MapView moved = *std::move(map);
  EXPECT_EQ(map->num_landmarks(), moved.num_landmarks());  // NOLINT: the state after a move is defined

  const auto resumed = System::create(TexturedWall::rig(), sequential(), {.map = file});
  ASSERT_TRUE(resumed) << resumed.error().message();
  EXPECT_EQ(resumed->map().num_landmarks(), landmarks.size());
  // A warning about a map is logged, and kept.
  auto saved = storage::read_map(file).value();
  saved.info.warning = "the images do not belong to the calibration";
  const auto doubtful = file.parent_path() / "doubtful.bmap", again = file.parent_path() / "again.bmap";
  ASSERT_TRUE(storage::write_map(saved.map, saved.info, doubtful));
  std::vector<std::string> lines;
  Startup startup{.map = doubtful};
  startup.callbacks.log = [&](LogLevel, std::string_view line) { lines.emplace_back(line); };
  const auto warned = System::create(TexturedWall::rig(), sequential(), startup);
  ASSERT_TRUE(warned) << warned.error().message();
  EXPECT_EQ(std::ranges::count(lines, "map: the run that made it has found: " + saved.info.warning), 1);
  ASSERT_TRUE(warned->save_map(again));
  EXPECT_EQ(storage::read_map(again)->info.warning, saved.info.warning);
  CameraCalibration other = TexturedWall::calibration(1);
  other.intrinsics[0] *= 1.1;
  const Rig another = Rig::make({TexturedWall::calibration(0), other}).value();
  const auto with_another = System::create(another, sequential(), {.map = file});
  ASSERT_TRUE(with_another) << with_another.error().message();
  EXPECT_EQ(with_another->map().rig().size(), 4u);  // the cameras of both rigs
  const auto with_one = System::create(TexturedWall::rig().subset({0}).value(), sequential(), {.map = file});
  ASSERT_TRUE(with_one) << with_one.error().message();
  EXPECT_EQ(with_one->map().rig().size(), 2u);
  Config refined = sequential();
  ASSERT_TRUE(refined.set("calibration.refine", "true"));
  EXPECT_FALSE(System::create(another, refined, {.map = file}));
  Config pyramid = sequential();
  ASSERT_TRUE(pyramid.set("features.levels", "5"));
  EXPECT_FALSE(System::create(TexturedWall::rig(), pyramid, {.map = file}));
}

TEST_F(PublicSystem, WarnsOnceOfTimesThatAreNotNanoseconds) {
  for (const std::int64_t unit : {1, 1000}) {
    std::vector<std::string> warnings;
    Startup startup;
    startup.callbacks.log = [&](LogLevel, std::string_view line) {
      if (line.find("check their unit") != std::string_view::npos) warnings.emplace_back(line);
    };
    auto system = System::create(TexturedWall::rig(), sequential(), startup).value();
    for (int k = 0; k < 30; ++k) {
      ImageBundle bundle = wall_.bundle(k);
      for (CameraImage& image : bundle.images) image.time_ns /= unit;
      ASSERT_TRUE(system.process(bundle));
    }
    ASSERT_EQ(warnings.size(), unit == 1 ? 0u : 1u);
    if (unit == 1) continue;
    EXPECT_EQ(warnings[0].find("20000 frames per second according to their times"), 0u);
  }
}

// The camera on the right looks past the wall's squares that the one on the left sees.
TEST_F(PublicSystem, SaysAtTheEndWhetherTheImagesContradictTheCalibration) {
  CameraCalibration turned = TexturedWall::calibration(1);
  turned.T_body_cam.rotation = {0, 0, 0.0131, 0.99991};  // by 1.5 degrees
  const Rig wrong = Rig::make({TexturedWall::calibration(0), turned}).value();
  const TemporaryFolder folder;
  for (const auto& [rig, refine, verdict] : {std::tuple(TexturedWall::rig(), "auto", CalibrationVerdict::kConsistent),
                                             {wrong, "auto", CalibrationVerdict::kInconsistent},
                                             {wrong, "false", CalibrationVerdict::kInconsistent}}) {
    Config config = sequential();
    ASSERT_TRUE(config.set("calibration.refine", refine));
    std::vector<std::string> warnings;
    Startup startup;
    startup.callbacks.log = [&](LogLevel level, std::string_view line) {
      if (level == LogLevel::kWarning) warnings.emplace_back(line);
    };
    auto system = System::create(rig, config, startup).value();
    process(system, 0, kFrames);
    EXPECT_EQ(system.calibration_verdict(), CalibrationVerdict::kUnknown);
    ASSERT_TRUE(system.finish());
    EXPECT_EQ(system.calibration_verdict(), verdict) << to_string(system.calibration_verdict());
    const auto has = [&](const std::string& text) {
      return std::ranges::any_of(warnings, [&](const std::string& w) { return w.find(text) != std::string::npos; });
    };
    const bool wrong_rig = verdict == CalibrationVerdict::kInconsistent, refined = std::string(refine) == "auto";
    EXPECT_EQ(has("the images contradict the calibration"), wrong_rig);
    EXPECT_EQ(has("right: estimated extrinsics differ from the calibration by"), wrong_rig);
    EXPECT_EQ(has("the map uses an estimate of it"), wrong_rig && refined);
    // A map with the contradicted calibration is not relied on later.
    ASSERT_TRUE(system.save_map(folder.path() / "a.bmap"));
    EXPECT_EQ(storage::read_map(folder.path() / "a.bmap")->info.warning.empty(), !wrong_rig || refined);
  }
}

// The rig could not be found in the map, and the map would be saved again without its words.
TEST_F(PublicSystem, DoesNotContinueAMapWithoutPlaceRecognition) {
  const TemporaryFolder folder;
  const auto with_words = folder.path() / "with.bmap", without = folder.path() / "without.bmap";
  for (const bool recognition : {true, false}) {
    auto system = make_system({.place_recognition = recognition});
    process(system, 0, 20);
    ASSERT_TRUE(system.save_map(recognition ? with_words : without));
  }
  const auto blind = System::create(TexturedWall::rig(), sequential(), {.map = with_words, .place_recognition = false});
  ASSERT_FALSE(blind);
  EXPECT_NE(blind.error().message().find("place_recognition"), std::string::npos) << blind.error().message();
  const auto warnings = [](const std::filesystem::path& map) {
    std::size_t count = 0;
    Startup startup{.map = map};
    startup.callbacks.log = [&](LogLevel level, std::string_view line) {
      count += level == LogLevel::kWarning && line.find("no visual words") != std::string_view::npos;
    };
    EXPECT_TRUE(System::create(TexturedWall::rig(), sequential(), startup));
    return count;
  };
  EXPECT_EQ(warnings(with_words), 0u);
  EXPECT_EQ(warnings(without), 1u);
}

TEST_F(PublicSystem, ReturnsErrorsForInvalidCalls) {
  auto system = make_system();
  process(system, 0, 3);
  const auto rejected = [&](auto change) {
    ImageBundle bundle = wall_.bundle(3);
    change(bundle);
    return !system.process(bundle).ok();
  };
  EXPECT_TRUE(rejected([](ImageBundle& b) { b.images.pop_back(); }));
  EXPECT_TRUE(rejected([](ImageBundle& b) { b.images.push_back(b.images[0]); }));
  EXPECT_TRUE(rejected([](ImageBundle& b) { b.images = {{}, {}}; }));
  EXPECT_TRUE(rejected([](ImageBundle& b) { b.images[1].width = 10; }));
  EXPECT_TRUE(rejected([](ImageBundle& b) { b.images[1].stride = 10; }));
  EXPECT_TRUE(rejected([](ImageBundle& b) { b.images[1].time_ns += 2'000'000'000; }));
  EXPECT_TRUE(rejected([&](ImageBundle& b) { b = wall_.bundle(2); }));
  EXPECT_TRUE(rejected([&](ImageBundle& b) { b = wall_.bundle(1); }));
  EXPECT_TRUE(rejected([&](ImageBundle& b) { b.images[1] = wall_.image(2, 1); }));
  EXPECT_FALSE(rejected([](ImageBundle& b) { b.images[1].data = nullptr; }));
  EXPECT_EQ(system.process(wall_.bundle(4)).value().frame, 4);  // what was rejected does not count
  ASSERT_TRUE(system.finish());
  EXPECT_FALSE(system.process(wall_.bundle(5)));
  EXPECT_FALSE(system.finish());
  System moved = std::move(system);
  EXPECT_FALSE(system.process(wall_.bundle(6)));  // NOLINT: the state after a move is defined
  EXPECT_EQ(system.map().num_keyframes(), 0u);
  EXPECT_GT(moved.map().num_keyframes(), 0u);
}

TEST_F(PublicSystem, RejectsInconsistentSettingsAndFiles) {
  Config localise = sequential();
  ASSERT_TRUE(localise.set("localize_only", "true"));
  EXPECT_FALSE(System::create(TexturedWall::rig(), localise));
  Config refine = sequential();
  ASSERT_TRUE(refine.set("calibration.refine", "true"));
  ASSERT_TRUE(refine.set("final_adjustment", "false"));
  EXPECT_FALSE(System::create(TexturedWall::rig(), refine));
  EXPECT_FALSE(System::create(TexturedWall::rig(), sequential(), {.map = "/no/such/file"}));
  EXPECT_FALSE(System::create(TexturedWall::rig(), sequential(), {.vocabulary = "/no/such/file"}));
}

TEST_F(PublicSystem, CallsCallbacksInTheCallersThread) {
  int keyframes = 0, maps = 0, lines = 0, cameras = 0, last_version = 0;
  System* running = nullptr;
  bool reentered = false;
  std::set<int> reported;
  Startup startup;
  startup.callbacks.keyframe = [&](const KeyframeEvent& e) {
    ++keyframes;
    EXPECT_EQ(e.keyframe, e.frame.keyframe_id);
    EXPECT_TRUE(reported.insert(e.keyframe).second) << "keyframe " << e.keyframe << " is reported twice";
    reentered |= running->process(wall_.bundle(kFrames)).ok();
  };
  startup.callbacks.map = [&](const MapView& map) {
    ++maps;
    EXPECT_GT(map.version(), last_version);
    last_version = map.version();
  };
  startup.callbacks.camera = [&](const CameraEvent& e) {
    ++cameras;
    EXPECT_EQ(e.camera, 1u);
  };
  startup.callbacks.log = [&](LogLevel, std::string_view) { ++lines; };
  auto system = make_system(startup);
  running = &system;
  process(system, 0, 10);
  EXPECT_EQ(cameras, 0);
  ImageBundle one = wall_.bundle(10);
  one.images[1].data = nullptr;
  EXPECT_EQ(system.process(one).value().cameras[1].state, CameraState::kOut);
  EXPECT_EQ(cameras, 1);
  ASSERT_TRUE(system.finish());
  EXPECT_EQ(static_cast<std::size_t>(keyframes), system.map().num_keyframes());
  EXPECT_GT(maps, 0);
  EXPECT_GT(lines, 1);
  EXPECT_EQ(system.map().version(), last_version);
  EXPECT_FALSE(reentered);
}

TEST_F(PublicSystem, ReturnsExceptionsOfCallbacksAndRemainsUsable) {
  Startup startup;
  startup.callbacks.keyframe = [](const KeyframeEvent&) { throw std::runtime_error("full disk"); };
  auto system = make_system(startup);
  const auto first = system.process(wall_.bundle(0));
  ASSERT_FALSE(first);
  EXPECT_NE(first.error().message().find("full disk"), std::string::npos);
  EXPECT_TRUE(system.process(wall_.bundle(1)).value().tracking());
}

TEST_F(PublicSystem, ReportsAllEventsAlthoughCallbacksThrow) {
  std::vector<int> keyframes;
  std::size_t maps = 0, cameras = 0;
  Startup startup;
  startup.callbacks.keyframe = [&](const KeyframeEvent& e) {
    keyframes.push_back(e.keyframe);
    throw std::runtime_error("keyframe " + std::to_string(keyframes.size()));
  };
  startup.callbacks.map = [&](const MapView&) { throw ++maps; };
  startup.callbacks.camera = [&](const CameraEvent&) { throw ++cameras; };
  auto system = make_system(startup);
  const auto first = system.process(wall_.bundle(0));
  ASSERT_FALSE(first);
  EXPECT_NE(first.error().message().find("keyframe 1"), std::string::npos) << first.error().message();
  EXPECT_EQ(maps, 1u) << "the map has changed as well";
  for (int k = 1; k < kFrames; ++k) {
    ImageBundle bundle = wall_.bundle(k);
    if (k == 10) bundle.images[1].data = nullptr;
    (void)system.process(bundle);
  }
  (void)system.finish();
  EXPECT_EQ(cameras, 2u) << "out, and again ok";
  EXPECT_EQ(keyframes.size(), system.map().num_keyframes());
  EXPECT_TRUE(std::ranges::is_sorted(keyframes, std::less_equal<>())) << "none is reported twice";
}

TEST_F(PublicSystem, DiscardsFramesBeyondItsHistory) {
  auto all = make_system(), few = make_system({.history_frames = 5});
  process(all, 0, kFrames);
  process(few, 0, kFrames);
  ASSERT_TRUE(all.finish());
  ASSERT_TRUE(few.finish());
  const Trajectory whole = all.trajectory().value(), rest = few.trajectory().value();
  ASSERT_EQ(whole.size(), static_cast<std::size_t>(kFrames));
  ASSERT_GE(rest.size(), 5u);
  ASSERT_LE(rest.size(), 10u);
  for (std::size_t i = 0; i < rest.size(); ++i) {
    const TimedPose &a = whole[whole.size() - rest.size() + i], &b = rest[i];
    EXPECT_EQ(a.time_ns, b.time_ns);
    EXPECT_EQ(a.T_world_frame.translation, b.T_world_frame.translation);
  }
}

TEST_F(PublicSystem, WarnsOfFormerNamesOfSettings) {
  const TemporaryFolder folder;
  support::write_text(folder.path() / "old.yaml", "bundling:\n  near_m: 0.4\n");
  Config config;
  ASSERT_TRUE(config.load(folder.path() / "old.yaml"));
  for (int twice = 0; twice < 2; ++twice) ASSERT_TRUE(config.set("mapping.culling.min_found_share", "0.3"));
  Startup startup;
  std::vector<std::string> warnings;
  startup.callbacks.log = [&](LogLevel level, std::string_view line) {
    if (level == LogLevel::kWarning) warnings.emplace_back(line);
  };
  const Config copy = config;
  ASSERT_TRUE(System::create(TexturedWall::rig(), copy, startup));
  ASSERT_EQ(warnings.size(), 2u);
  EXPECT_TRUE(warnings[0].starts_with("setting 'bundling.near_m' is now called '")) << warnings[0];
  EXPECT_TRUE(warnings[1].starts_with("setting 'mapping.culling.min_found_share' is now called '")) << warnings[1];
}

// Images with padded rows give the same results as packed images.
TEST_F(PublicSystem, ReadsImagesWithAnyStride) {
  auto borrowed = make_system(), packed = make_system();
  for (int k = 0; k < 10; ++k) {
    ImageBundle bundle = wall_.bundle(k);
    const FrameResult a = borrowed.process(bundle).value();
    std::vector<std::vector<std::uint8_t>> copies;
    for (CameraImage& image : bundle.images) {
      auto& copy = copies.emplace_back();
      for (int y = 0; y < image.height; ++y) {
        copy.insert(copy.end(), image.data + y * image.stride, image.data + y * image.stride + image.width);
      }
      image.data = copy.data();
      image.stride = image.width;
    }
    const FrameResult b = packed.process(bundle).value();
    EXPECT_EQ(a.T_world_cam0.translation, b.T_world_cam0.translation);
    EXPECT_EQ(a.T_world_cam0.rotation, b.T_world_cam0.rotation);
  }
}

// The mask of camera 1 is 0 everywhere, and so that camera has no keypoints.
TEST_F(PublicSystem, IgnoresPixelsMaskedInAnImage) {
  System system = make_system();
  ImageBundle bundle = wall_.bundle(0);
  CameraImage& image = bundle.images[1];
  const std::vector<std::uint8_t> mask(static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height),
                                       0);
  image.mask = mask.data();
  EXPECT_NE(system.process(bundle).error().message().find("stride"), std::string::npos);
  image.mask_stride = image.width;
  const auto frame = system.process(bundle);
  ASSERT_TRUE(frame) << frame.error().message();
  EXPECT_GT(frame->cameras[0].keypoints, 100);
  EXPECT_EQ(frame->cameras[1].keypoints, 0);
}

}  // namespace
}  // namespace bslam
