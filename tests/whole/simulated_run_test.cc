// Runs from rendered images on disk to a trajectory, for every number of cameras.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "evaluation/trajectory_error.h"
#include "evaluation/trajectory_file.h"
#include "session/run_session.h"
#include "simulator/simulation_writer.h"
#include "synthetic/rigs.h"

namespace bslam {
namespace {

namespace fs = std::filesystem;

constexpr int kCameras = 8, kWidth = 376;
constexpr double kDuration_s = 3.0, kRate_hz = 12.0;

// A short recording of eight small cameras, rendered once for all tests of this program.
class SimulatedRun : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = fs::temp_directory_path() / ("bslam_whole_" + std::to_string(::getpid()));
    simulator::SimulationRequest request{.folder = folder_,
                                         .rig = synthetic::ring_rig(kCameras, kWidth),
                                         .recording = {.duration_s = kDuration_s, .rate_hz = kRate_hz},
                                         .tour = {},
                                         .imaging = {},
                                         .world = {}};
    ThreadPool pool(2);
    const auto written = simulator::write_simulation(request, pool);
    ASSERT_TRUE(written) << written.error().message();
  }
  static void TearDownTestSuite() { fs::remove_all(folder_); }

  static dataset::Dataset open(int cameras) {
    std::vector<int> used;
    for (int c = 0; c < cameras; ++c) used.push_back(c);
    auto dataset = dataset::open_dataset({.path = folder_, .cameras = used});
    EXPECT_TRUE(dataset) << dataset.error().message();
    return std::move(*dataset);
  }

  static session::SessionResult run(const dataset::Dataset& dataset,
                                    execution::Mode mode = execution::Mode::kSequential) {
    session::SessionOptions options;
    options.config.mode = mode;
    options.config.features.per_image = 600;  // small images
    auto result = session::run_session(dataset, options);
    EXPECT_TRUE(result) << result.error().message();
    return std::move(*result);
  }

  static evaluation::TrajectoryEvaluation evaluate(const evaluation::Trajectory& estimate,
                                                   evaluation::AlignMode align) {
    const auto truth = evaluation::read_trajectory(folder_ / "groundtruth_cam0.tum");
    EXPECT_TRUE(truth);
    auto evaluated = evaluation::evaluate(estimate, *truth, {.align = align});
    EXPECT_TRUE(evaluated) << evaluated.error().message();
    return std::move(*evaluated);
  }

  static inline fs::path folder_;
};

TEST_F(SimulatedRun, TracksWithEveryNumberOfCamerasFromTwoUp) {
  for (const int cameras : {2, 3, 4, 5, 6, 7, 8}) {
    const dataset::Dataset dataset = open(cameras);
    const session::SessionResult result = run(dataset);
    EXPECT_EQ(result.trajectories.front().poses.size(), dataset.frames.size()) << cameras << " cameras";
    EXPECT_EQ(result.record.map.scale, "metric") << cameras << " cameras";
    EXPECT_LT(evaluate(result.trajectories.front().poses, evaluation::AlignMode::kSe3).ate.rmse, 0.02)
        << cameras << " cameras";
  }
}

TEST_F(SimulatedRun, OneCameraTracksUpToScale) {
  const dataset::Dataset dataset = open(1);
  const session::SessionResult result = run(dataset);
  EXPECT_EQ(result.record.map.scale, "up-to-scale");
  EXPECT_GT(result.trajectories.front().poses.size(), dataset.frames.size() / 2);
  EXPECT_EQ(result.record.frames.size(), dataset.frames.size());
  EXPECT_LT(evaluate(result.trajectories.front().poses, evaluation::AlignMode::kSim3).ate.rmse, 0.03);
}

TEST_F(SimulatedRun, SequentialRunsAreDeterministic) {
  const dataset::Dataset dataset = open(4);
  const session::SessionResult first = run(dataset), second = run(dataset);
  EXPECT_EQ(evaluation::tum_text(first.trajectories.front().poses, ""),
            evaluation::tum_text(second.trajectories.front().poses, ""));
  EXPECT_EQ(evaluation::tum_text(first.live.front().poses, ""), evaluation::tum_text(second.live.front().poses, ""));
}

TEST_F(SimulatedRun, ParallelRunsAreSimilarlyAccurate) {
  const dataset::Dataset dataset = open(4);
  const session::SessionResult result = run(dataset, execution::Mode::kParallel);
  EXPECT_EQ(result.trajectories.front().poses.size(), dataset.frames.size());
  EXPECT_LT(evaluate(result.trajectories.front().poses, evaluation::AlignMode::kSe3).ate.rmse, 0.02);
}

TEST_F(SimulatedRun, DamagedImageIsSkippedForItsCameraAndCounted) {
  const fs::path copy = folder_.string() + "_damaged";
  fs::copy(folder_, copy, fs::copy_options::recursive);
  auto dataset = dataset::open_dataset({.path = copy, .cameras = {0, 1, 2, 3}});
  ASSERT_TRUE(dataset);
  fs::resize_file(dataset->frames[10].images[0]->path, 500);
  std::ofstream(dataset->frames[20].images[2]->path) << "no image";
  const session::SessionResult result = run(*dataset);
  EXPECT_EQ(result.trajectories.front().poses.size(), dataset->frames.size());
  EXPECT_EQ(result.record.cameras[0].skipped, 1);
  EXPECT_EQ(result.record.cameras[1].skipped, 0);
  EXPECT_EQ(result.record.cameras[2].skipped, 1);
  fs::remove_all(copy);
}

}  // namespace
}  // namespace bslam
