#include "session/rig_calibration.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include "rig_formats/bslam_rig.h"
#include "simulator/simulation_writer.h"
#include "synthetic/rigs.h"

namespace bslam::session {
namespace {

namespace fs = std::filesystem;

constexpr double kDegree = 3.14159265358979 / 180;

// Forty frames of two cameras on disk, written once per process.
class RigCalibrationOfRecording : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder() = fs::temp_directory_path() / ("bslam_rig_calibration_test_" + std::to_string(::getpid()));
    ThreadPool pool(2);
    const simulator::SimulationRequest request{.folder = folder(),
                                               .rig = synthetic::ring_rig(2, 376),
                                               .recording = {.duration_s = 4, .rate_hz = 10},
                                               .tour = {.duration_s = 4},
                                               .imaging = {},
                                               .world = {.texel = 0.02, .light_texel = 0.8, .ambient_rays = 2}};
    const auto outcome = simulator::write_simulation(request, pool);
    ASSERT_TRUE(outcome.ok()) << outcome.error().message();
  }
  static void TearDownTestSuite() { fs::remove_all(folder()); }
  static fs::path& folder() {
    static fs::path path;
    return path;
  }
  static dataset::Dataset opened(std::vector<int> cameras = {}) {
    auto out = dataset::open_dataset({.path = folder(), .cameras = std::move(cameras)});
    EXPECT_TRUE(out.ok());
    return std::move(*out);
  }
  static RigCalibrationRequest request() {
    RigCalibrationRequest out;
    out.config = rig_calibration_config();
    out.config.features.per_image = 500;
    return out;
  }
};

// The rig with focal lengths 3 % too long and camera 1 rotated by a degree about its vertical axis.
camera::Rig rough(const camera::Rig& rig) {
  geometry::Vector6d turn = geometry::Vector6d::Zero();
  turn[1] = kDegree;
  std::vector<camera::RigCamera> cameras;
  for (std::size_t c = 0; c < rig.size(); ++c) {
    const geometry::SE3 T_cam_rig = c == 1 ? rig.cam_from_rig(c).perturbed(turn) : rig.cam_from_rig(c);
    cameras.push_back({camera::zoomed(rig.camera(c), 1.03), rig.body_from_cam(0) * T_cam_rig.inverse()});
  }
  return camera::Rig(std::move(cameras));
}

double angle_deg(const geometry::SE3& a, const geometry::SE3& b) {
  return a.rotation().angularDistance(b.rotation()) / kDegree;
}

TEST_F(RigCalibrationOfRecording, CorrectsARoughStart) {
  std::vector<dataset::Dataset> recordings = {opened()};
  const camera::Rig truth = recordings[0].rig, start = rough(truth);
  recordings[0].rig = start;
  recordings[0].whole_rig = start;
  const auto found = calibrate_rig(recordings, request());
  ASSERT_TRUE(found.ok()) << found.error().message();
  EXPECT_GE(found->runs, 2);
  const camera::Rig& rig = found->joint.rig;
  EXPECT_LT(angle_deg(rig.cam_from_rig(1), truth.cam_from_rig(1)), 0.1);
  for (std::size_t c = 0; c < 2; ++c) {
    const double fx = camera::parameters(truth.camera(c).model)(0),
                 estimate = camera::parameters(rig.camera(c).model)(0);
    EXPECT_LT(std::abs(estimate / fx - 1), 0.01) << "camera " << c;
    EXPECT_LT(std::abs(estimate - fx), 4 * found->joint.cameras[c].intrinsics[0].std) << "camera " << c;
  }
  EXPECT_GT(found->scale_std, 0);

  const std::string text = calibration_text(*found);
  EXPECT_NE(text.find("rotation y"), std::string::npos) << text;
  EXPECT_NE(text.find("not observable from any images: the common factor"), std::string::npos) << text;
  const auto read = rig_formats::read_bslam_rig("rig.yaml", calibrated_rig_yaml(*found));
  ASSERT_TRUE(read.ok()) << read.error().message();
  EXPECT_TRUE(camera::Rig(read->cameras).same_intrinsics(rig));
}

// What a recording shows of the times of cameras is the prior of the next one.
TEST_F(RigCalibrationOfRecording, ARecordingGetsTheTimesOfAnotherOne) {
  constexpr TimeNs kLater = 20'000'000;
  constexpr double kReadout_s = 0.03;
  const dataset::Dataset before = opened();
  solver::RigValues values = solver::RigValues::of(before.rig);
  values.timing[1] = {to_seconds(kLater), kReadout_s};
  const dataset::Dataset after = with_times_of(values.applied_to(before.rig), before);
  EXPECT_EQ(after.rig.camera(0u).time_offset_ns, before.rig.camera(0u).time_offset_ns);
  EXPECT_EQ(after.rig.camera(1u).time_offset_ns, before.rig.camera(1u).time_offset_ns + kLater);
  EXPECT_EQ(after.rig.camera(1u).readout_s, kReadout_s);
  EXPECT_EQ(after.rig.cam_from_rig(1).matrix(), before.rig.cam_from_rig(1).matrix());
  for (std::size_t f = 0; f < before.frames.size(); ++f) {
    EXPECT_EQ(after.frames[f].time_ns, before.frames[f].time_ns);
    EXPECT_EQ(after.frames[f].images[0]->time_ns, before.frames[f].images[0]->time_ns);
    EXPECT_EQ(after.frames[f].images[1]->time_ns, before.frames[f].images[1]->time_ns + kLater);
  }
  EXPECT_TRUE(with_times_of(before.rig, before).rig.same_calibration(before.rig));
}

TEST(NominalIntrinsics, HaveTheGivenFieldOfView) {
  const camera::Rig rig = synthetic::ring_rig(2, 376);
  for (const char* model : {"pinhole", "pinhole-radtan", "kannala-brandt"}) {
    const auto nominal = with_nominal_intrinsics(rig, model, 90);
    ASSERT_TRUE(nominal.ok()) << nominal.error().message();
    const camera::Camera& camera = nominal->camera(1);
    const auto pixel = camera.project(Eigen::Vector3d(1, 0, 1));
    ASSERT_TRUE(pixel.has_value());
    EXPECT_NEAR(pixel->x(), camera.width - 0.5, 1e-6) << model;
    EXPECT_EQ(camera::model_name(camera.model), model);
  }
  EXPECT_FALSE(with_nominal_intrinsics(rig, "pinhole", 175).ok());
  EXPECT_FALSE(with_nominal_intrinsics(rig, "ucm", 90).ok());
}

TEST_F(RigCalibrationOfRecording, CorrectsTheIntrinsicsOfASingleCamera) {
  std::vector<dataset::Dataset> recordings = {opened({0})};
  const double fx = camera::parameters(recordings[0].rig.camera(0).model)(0);
  recordings[0].rig = rough(recordings[0].rig);
  recordings[0].whole_rig.reset();
  const auto found = calibrate_rig(recordings, request());
  ASSERT_TRUE(found.ok()) << found.error().message();
  const double estimate = camera::parameters(found->joint.rig.camera(0).model)(0);
  EXPECT_LT(std::abs(estimate / fx - 1), 0.01);
  EXPECT_LT(std::abs(estimate - fx), 4 * found->joint.cameras[0].intrinsics[0].std);
  EXPECT_EQ(found->scale_std, 0);
  const std::string text = calibration_text(*found);
  EXPECT_EQ(text.find("common factor"), std::string::npos) << text;
  EXPECT_EQ(text.find("rotation y"), std::string::npos) << text;
}

}  // namespace
}  // namespace bslam::session
