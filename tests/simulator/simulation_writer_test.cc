#include "simulator/simulation_writer.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include "dataset/dataset.h"
#include "evaluation/trajectory_file.h"
#include "rig_formats/rig_file.h"
#include "simulator/clearance.h"
#include "synthetic/rigs.h"

namespace bslam::simulator {
namespace {

namespace fs = std::filesystem;

class SimulationWriter : public testing::Test {
 protected:
  ~SimulationWriter() override { fs::remove_all(folder_); }

  // Three frames of two small cameras in a world with few details.
  SimulationRequest request() const {
    SimulationRequest r{.folder = folder_ / "sim",
                        .rig = synthetic::ring_rig(2, 64),
                        .recording = {},
                        .tour = {},
                        .imaging = {},
                        .world = {.texel = 0.05, .light_texel = 2.0, .ambient_rays = 1}};
    r.recording.duration_s = 0.3;
    r.recording.rate_hz = 10;
    return r;
  }

  // Returns the bytes of all files except the markers, by name within the folder.
  std::map<std::string, std::string> contents(const fs::path& folder) const {
    std::map<std::string, std::string> files;
    for (const auto& entry : fs::recursive_directory_iterator(folder)) {
      if (!entry.is_regular_file() || entry.path().filename().string().front() == '.') continue;
      std::ostringstream bytes;
      bytes << std::ifstream(entry.path(), std::ios::binary).rdbuf();
      files[fs::relative(entry.path(), folder).string()] = bytes.str();
    }
    return files;
  }

  fs::path folder_ = fs::temp_directory_path() / ("bslam_simulation_" + std::to_string(::getpid()));
  ThreadPool pool_{2};
};

TEST_F(SimulationWriter, WritesEurocLayoutWithGroundTruth) {
  const SimulationRequest r = request();
  const auto outcome = write_simulation(r, pool_);
  ASSERT_TRUE(outcome.ok());
  EXPECT_EQ(*outcome, SimulationOutcome::kWritten);
  const auto files = contents(r.folder);
  EXPECT_EQ(files.size(), 2u * (3 + 2) + 4);
  EXPECT_TRUE(files.contains("mav0/cam1/data/1200000000.png"));
  EXPECT_EQ(
      files.at("mav0/cam0/data.csv"),
      "#timestamp [ns],filename\n1000000000,1000000000.png\n1100000000,1100000000.png\n1200000000,1200000000.png\n");
  const auto rig = rig_formats::read_rig(r.folder / "rig.yaml"), euroc = rig_formats::read_rig(r.folder);
  ASSERT_TRUE(rig.ok());
  ASSERT_TRUE(euroc.ok());
  for (std::size_t c = 0; c < 2; ++c) {
    EXPECT_LT((rig->body_from_cam(c).matrix() - r.rig.body_from_cam(c).matrix()).norm(), 1e-9);
    EXPECT_LT((euroc->body_from_cam(c).matrix() - r.rig.body_from_cam(c).matrix()).norm(), 1e-9);
  }
}

TEST_F(SimulationWriter, WritesNoSensorYamlForUnsupportedModels) {
  SimulationRequest r = request();
  std::vector<camera::RigCamera> cameras;
  for (std::size_t c = 0; c < 2; ++c) cameras.push_back({r.rig.camera(c), r.rig.body_from_cam(c)});
  cameras[1].camera.model = camera::DoubleSphere({30, 30, 31.5, 19.5}, -0.2, 0.55);
  r.rig = camera::Rig(cameras);
  ASSERT_TRUE(write_simulation(r, pool_).ok());
  EXPECT_FALSE(contents(r.folder).contains("mav0/cam0/sensor.yaml"));
  const auto dataset = dataset::open_dataset({.path = r.folder});
  ASSERT_TRUE(dataset) << dataset.error().message();
  EXPECT_EQ(camera::model_name(dataset->rig.camera(std::size_t{1}).model), camera::DoubleSphere::kName);
  const auto by_mav0 = dataset::open_dataset({.path = r.folder / "mav0"});
  ASSERT_TRUE(by_mav0) << by_mav0.error().message();
  EXPECT_TRUE(rig_formats::read_rig(r.folder).ok());
}

// A recording of an older version, with other lists and the same images.
TEST_F(SimulationWriter, RewritesListsOfAnotherVersion) {
  const SimulationRequest r = request();
  ASSERT_TRUE(write_simulation(r, pool_).ok());
  const auto files = contents(r.folder);
  const fs::path image_path = r.folder / "mav0/cam0/data/1100000000.png";
  const auto rendered = fs::last_write_time(image_path);
  std::ofstream(r.folder / ".complete") << simulation_digest(r) << "\n";
  std::ofstream(r.folder / "faults.csv") << "old";
  EXPECT_EQ(*write_simulation(r, pool_), SimulationOutcome::kWritten);
  EXPECT_EQ(contents(r.folder), files);
  EXPECT_EQ(fs::last_write_time(image_path), rendered);
  EXPECT_EQ(*write_simulation(r, pool_), SimulationOutcome::kWasComplete);
}

TEST_F(SimulationWriter, WritesConsistentGroundTruths) {
  const SimulationRequest r = request();
  ASSERT_TRUE(write_simulation(r, pool_).ok());
  const auto body = evaluation::read_trajectory(r.folder / "mav0/state_groundtruth_estimate0/data.csv");
  const auto camera = evaluation::read_trajectory(r.folder / "groundtruth_cam0.tum");
  ASSERT_TRUE(body.ok());
  ASSERT_TRUE(camera.ok());
  ASSERT_EQ(camera->size(), 3u);
  EXPECT_EQ(body->size(), 61u);
  for (std::size_t i = 0; i < 3; ++i) {
    const evaluation::TimedPose& of_body = (*body)[20 * i];
    ASSERT_EQ(of_body.time_ns, (*camera)[i].time_ns);
    const geometry::SE3 expected = of_body.T_world_frame * r.rig.body_from_cam(0);
    EXPECT_LT((expected.matrix() - (*camera)[i].T_world_frame.matrix()).norm(), 1e-7);
  }
}

TEST_F(SimulationWriter, RendersACompleteRequestOnlyOnce) {
  const SimulationRequest r = request();
  ASSERT_TRUE(write_simulation(r, pool_).ok());
  const auto again = write_simulation(r, pool_);
  ASSERT_TRUE(again.ok());
  EXPECT_EQ(*again, SimulationOutcome::kWasComplete);
}

TEST_F(SimulationWriter, StopsBeforeTheFirstImage) {
  const SimulationRequest r = request();
  std::stop_source source;
  source.request_stop();
  const auto stopped = write_simulation(r, pool_, {}, source.get_token());
  ASSERT_TRUE(stopped.ok());
  EXPECT_EQ(*stopped, SimulationOutcome::kInterrupted);
  EXPECT_TRUE(fs::is_empty(r.folder / "mav0/cam0/data"));
  EXPECT_EQ(*write_simulation(r, pool_), SimulationOutcome::kWritten);
}

TEST_F(SimulationWriter, ContinuesAfterAnInterruption) {
  SimulationRequest whole = request(), r = request();
  whole.folder = folder_ / "whole";
  ASSERT_TRUE(write_simulation(whole, pool_).ok());
  std::atomic<std::size_t> first = 0;
  std::stop_source source;
  const auto stop_at_two = [&](std::size_t done, std::size_t) {
    first = done;
    if (done >= 2) source.request_stop();
  };
  const auto stopped = write_simulation(r, pool_, stop_at_two, source.get_token());
  ASSERT_TRUE(stopped.ok());
  EXPECT_EQ(*stopped, SimulationOutcome::kInterrupted);
  EXPECT_LT(first, 6u);
  EXPECT_TRUE(fs::exists(r.folder / ".partial"));
  const fs::path kept = r.folder / "mav0/cam0/data/1000000000.png";
  const auto written_at = fs::last_write_time(kept);
  const auto resumed = write_simulation(r, pool_);
  ASSERT_TRUE(resumed.ok());
  EXPECT_EQ(*resumed, SimulationOutcome::kWritten);
  EXPECT_EQ(fs::last_write_time(kept), written_at);
  EXPECT_FALSE(fs::exists(r.folder / ".partial"));
  EXPECT_EQ(contents(r.folder), contents(whole.folder));
}

TEST_F(SimulationWriter, DoesNotChangeOtherFolders) {
  const SimulationRequest r = request();
  fs::create_directories(r.folder);
  std::ofstream(r.folder / "letter.txt") << "mine";
  const auto rejected = write_simulation(r, pool_);
  ASSERT_FALSE(rejected.ok());
  EXPECT_EQ(contents(r.folder).size(), 1u);
  SimulationRequest allowed = r;
  allowed.overwrite = true;
  ASSERT_TRUE(write_simulation(allowed, pool_).ok());
  EXPECT_EQ(contents(r.folder).at("letter.txt"), "mine");
}

TEST_F(SimulationWriter, ReplacesImagesOfOtherRecordings) {
  SimulationRequest r = request();
  const fs::path image_path = r.folder / "mav0/cam0/data/1000000000.png";
  fs::create_directories(image_path.parent_path());
  std::ofstream(image_path) << "foreign";
  r.overwrite = true;
  ASSERT_TRUE(write_simulation(r, pool_).ok());
  EXPECT_GT(fs::file_size(image_path), 100u);
}

TEST_F(SimulationWriter, ReplacesAnotherRecordingOnlyWithOverwrite) {
  SimulationRequest r = request();
  ASSERT_TRUE(write_simulation(r, pool_).ok());
  r.recording.duration_s = 0.2;
  EXPECT_FALSE(write_simulation(r, pool_).ok());
  r.overwrite = true;
  ASSERT_TRUE(write_simulation(r, pool_).ok());
  EXPECT_FALSE(fs::exists(r.folder / "mav0/cam0/data/1200000000.png"));
}

TEST_F(SimulationWriter, ListsImagesAffectedByFaults) {
  SimulationRequest r = request();
  r.recording.faults = {{FaultType::kDropped, {0}, 0.1, 0.15, 0}, {FaultType::kFrozen, {1}, 0.2, 9, 0}};
  ASSERT_TRUE(write_simulation(r, pool_).ok());
  const auto files = contents(r.folder);
  EXPECT_EQ(files.at("faults.csv"),
            "#timestamp [ns],camera,filename,fault\n"
            "1100000000,0,1100000000.png,dropped\n1200000000,1,1200000000.png,frozen\n");
  EXPECT_FALSE(files.contains("mav0/cam0/data/1100000000.png"));
  EXPECT_EQ(files.at("mav0/cam0/data.csv"),
            "#timestamp [ns],filename\n1000000000,1000000000.png\n1200000000,1200000000.png\n");
  EXPECT_EQ(files.at("mav0/cam1/data/1200000000.png"), files.at("mav0/cam1/data/1100000000.png"));
  EXPECT_EQ(evaluation::read_trajectory(r.folder / "groundtruth_cam0.tum")->size(),
            3u);  // poses exist for dropped images as well
}

TEST_F(SimulationWriter, RejectsRequestsOutOfRange) {
  const auto rejected = [&](auto change) {
    SimulationRequest r = request();
    change(r);
    const bool wrong = !write_simulation(r, pool_).ok();
    return wrong && !fs::exists(r.folder);
  };
  EXPECT_TRUE(rejected([](SimulationRequest& r) { r.recording.duration_s = -1; }));
  EXPECT_TRUE(rejected([](SimulationRequest& r) { r.recording.duration_s = std::nan(""); }));
  EXPECT_TRUE(rejected([](SimulationRequest& r) { r.recording.rate_hz = 0; }));
  EXPECT_TRUE(rejected([](SimulationRequest& r) { r.recording.exposure_s = -0.1; }));
  EXPECT_TRUE(rejected([](SimulationRequest& r) { r.imaging.noise = -1; }));
  EXPECT_TRUE(rejected([](SimulationRequest& r) { r.tour.laps = -1; }));
  EXPECT_TRUE(rejected([](SimulationRequest& r) { r.recording.faults = {{FaultType::kBlack, {0}, 0.3, 0.4}}; }));
  EXPECT_TRUE(rejected([](SimulationRequest& r) { r.tour.laps = 1, r.tour.speed_mps = 1; }));
}

// The cameras of the ring, `metres` further forward on the body.
camera::Rig moved_ahead(const camera::Rig& rig, double metres) {
  std::vector<camera::RigCamera> cameras;
  for (std::size_t c = 0; c < rig.size(); ++c) {
    const geometry::SE3& T = rig.body_from_cam(c);
    cameras.push_back({rig.camera(c), geometry::SE3(T.rotation(), T.translation() + Eigen::Vector3d(metres, 0, 0))});
  }
  return camera::Rig(std::move(cameras));
}

TEST_F(SimulationWriter, RefusesARigThatPassesThroughWalls) {
  SimulationRequest r = request();
  r.recording.duration_s = 30;  // with turns to the left
  r.rig = moved_ahead(r.rig, 2.5);
  const auto refused = write_simulation(r, pool_);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().key, "rig");
  EXPECT_TRUE(refused.error().found.starts_with("camera ")) << refused.error().found;
  EXPECT_NE(refused.error().expected.find("--world outdoor"), std::string::npos);
  EXPECT_FALSE(fs::exists(r.folder));
}

TEST(Clearance, FindsTheFirstCameraInAWallOrBehindIt) {
  const camera::Rig rig = synthetic::ring_rig(2, 64);
  const synthetic::Trajectory still(std::vector<synthetic::ControlPose>(5, {{0, 0, 1}}), 1.0);
  const double ahead = rig.body_from_cam(0).translation().x();
  const auto wall_at = [](double x) { return std::vector<Surface>{{{x, -2, 0}, {0, 4, 0}, {0, 0, 2}, {}}}; };
  EXPECT_FALSE(first_collision(wall_at(ahead + 0.06), rig, still, 0, 1));
  const auto close = first_collision(wall_at(ahead + 0.04), rig, still, 0, 1);
  ASSERT_TRUE(close);
  EXPECT_NEAR(close->distance, 0.04, 0.02);
  const auto behind = first_collision(wall_at(ahead - 0.06), rig, still, 0, 1);
  ASSERT_TRUE(behind);
  EXPECT_EQ(behind->distance, 0);
}

// A drive of two sections with three frames of two small cameras.
class TownWriter : public SimulationWriter {
 protected:
  SimulationRequest drive() const {
    SimulationRequest r = request();
    r.kind = WorldKind::kTown;
    r.tour.length_m = 200;
    r.recording.duration_s = *drive_duration(r);
    r.recording.rate_hz = 0.1;
    r.world = {.texel = 0.1, .texel_per_distance = 0.05, .light_texel = 5, .ambient_rays = 1};
    return r;
  }
};

TEST_F(TownWriter, HasNoDurationIfADriveTakesMoreThanADay) {
  SimulationRequest r = drive();
  r.tour.length_m = 100e3;
  r.tour.speed_mps = 1.0;
  const auto duration_s = drive_duration(r);
  ASSERT_FALSE(duration_s.ok());
  EXPECT_EQ(duration_s.error().key, "length");
}

TEST_F(TownWriter, ContinuesInAnySection) {
  SimulationRequest whole = drive(), r = drive();
  EXPECT_NEAR(r.recording.duration_s, 29, 3);
  whole.folder = folder_ / "whole";
  ASSERT_TRUE(write_simulation(whole, pool_).ok());
  std::stop_source source;
  const auto stop_at_two = [&](std::size_t done, std::size_t) {
    if (done >= 2) source.request_stop();
  };
  EXPECT_EQ(*write_simulation(r, pool_, stop_at_two, source.get_token()), SimulationOutcome::kInterrupted);
  const fs::path kept = r.folder / "mav0/cam0/data/1000000000.png";
  const auto written_at = fs::last_write_time(kept);
  EXPECT_EQ(*write_simulation(r, pool_), SimulationOutcome::kWritten);
  EXPECT_EQ(fs::last_write_time(kept), written_at);
  EXPECT_EQ(contents(r.folder), contents(whole.folder));
}

TEST_F(TownWriter, RejectsRequestsThatDoNotFit) {
  const SimulationRequest fits = drive();
  const auto key_of_error = [&](auto change) {
    SimulationRequest r = fits;
    change(r);
    const auto outcome = write_simulation(r, pool_);
    EXPECT_FALSE(fs::exists(r.folder));
    return outcome ? std::string("none") : outcome.error().key;
  };
  EXPECT_EQ(key_of_error([](SimulationRequest& r) { r.tour.length_m = 150; }), "length");
  EXPECT_EQ(key_of_error([](SimulationRequest& r) { r.tour.length_m = 2e5; }), "length");
  EXPECT_EQ(key_of_error([](SimulationRequest& r) { r.tour.length_m = std::nan(""); }), "length");
  EXPECT_EQ(key_of_error([](SimulationRequest& r) { r.tour.speed_mps = 25; }), "speed");
  EXPECT_EQ(key_of_error([](SimulationRequest& r) { r.tour.speed_mps = 0.1; }), "speed");
  EXPECT_EQ(key_of_error([](SimulationRequest& r) { r.tour.laps = 2; }), "laps");
  EXPECT_EQ(key_of_error([](SimulationRequest& r) { r.tour.back = true; }), "back");
  EXPECT_EQ(key_of_error([](SimulationRequest& r) { r.recording.duration_s = 100; }), "duration");
  EXPECT_EQ(key_of_error([](SimulationRequest& r) { r.kind = WorldKind::kOutdoor; }), "length");
  EXPECT_EQ(key_of_error([](SimulationRequest& r) { r.rig = moved_ahead(r.rig, 20); }), "rig");
}

TEST_F(SimulationWriter, WorldAndTourHaveTheirOwnSeeds) {
  SimulationRequest a = request(), b = request();
  b.tour.seed = 2;
  EXPECT_NE(simulation_digest(a), simulation_digest(b));
  b.folder = folder_ / "other";
  ASSERT_TRUE(write_simulation(a, pool_));
  ASSERT_TRUE(write_simulation(b, pool_));
  EXPECT_NE(contents(a.folder).at("groundtruth_cam0.tum"), contents(b.folder).at("groundtruth_cam0.tum"));
}

TEST_F(SimulationWriter, BeginsAtTheGivenTime) {
  SimulationRequest r = request();
  r.recording.start_ns = 1'700'000'000'000'000'000;
  ASSERT_TRUE(write_simulation(r, pool_));
  EXPECT_TRUE(contents(r.folder).contains("mav0/cam0/data/1700000000000000000.png"));
}

}  // namespace
}  // namespace bslam::simulator
