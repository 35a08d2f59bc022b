// Runs on real images in ../shared/data, if they are present; they are not part of the repository.
#include <gtest/gtest.h>

#include <array>
#include <filesystem>

#include "evaluation/trajectory_error.h"
#include "evaluation/trajectory_file.h"
#include "session/run_session.h"
#include "session/run_warnings.h"

namespace bslam {
namespace {

struct RealCase {
  const char* folder;
  std::vector<int> cameras;  // all cameras if empty
  double max_ate_m;          // loose bound, but far below the error with a wrong scale or lost intervals
};

void PrintTo(const RealCase& c, std::ostream* out) {
  *out << c.folder << " with " << c.cameras.size() << " cameras named";
}

class RealData : public testing::TestWithParam<RealCase> {};

// No image of these recordings is bad: cameras are out only while they have none.
TEST_P(RealData, TracksEveryFrameWithEveryCamera) {
  const std::filesystem::path data = std::filesystem::path(BSLAM_SHARED_DIR) / "data" / GetParam().folder;
  if (!std::filesystem::is_directory(data)) GTEST_SKIP() << data << " is not present";
  const auto dataset = dataset::open_dataset({.path = data, .cameras = GetParam().cameras});
  ASSERT_TRUE(dataset) << dataset.error().message();
  session::SessionOptions options;
  options.config.mode = execution::Mode::kSequential;
  const auto result = session::run_session(*dataset, options);
  ASSERT_TRUE(result) << result.error().message();
  EXPECT_EQ(result->trajectories.front().poses.size(), dataset->frames.size());
  for (const session::CameraRecord& camera : result->record.cameras) {
    for (const session::CameraInterval& interval : camera.states)
      EXPECT_TRUE(interval.status.reason == tracking::CameraReason::kNone ||
                  interval.status.reason == tracking::CameraReason::kNoImages)
          << camera.name << " from " << interval.from_s << " s";
  }
  const auto truth = evaluation::read_trajectory(data / "groundtruth_cam0.tum");
  ASSERT_TRUE(truth) << truth.error().message();
  const auto evaluated = evaluation::evaluate(result->trajectories.front().poses, *truth, {});
  ASSERT_TRUE(evaluated) << evaluated.error().message();
  EXPECT_LT(evaluated->ate.rmse, GetParam().max_ate_m);
}

INSTANTIATE_TEST_SUITE_P(Sets, RealData,
                         testing::Values(RealCase{"kitti_06_start", {}, 0.1}, RealCase{"aria_gen2_4cam", {}, 0.01},
                                         RealCase{"aria_gen2_4cam", {0, 1}, 0.01}, RealCase{"kitti_0039", {}, 0.25}));

// Calibrations of two cameras are exchanged: nothing starts, and the images tell why.
TEST(RealData, ExchangedCalibrationsAreNamedIfNothingStarts) {
  const std::filesystem::path data = std::filesystem::path(BSLAM_SHARED_DIR) / "data/aria_gen2_4cam";
  if (!std::filesystem::is_directory(data)) GTEST_SKIP() << data << " is not present";
  for (const std::array exchange : {std::array{1, 0, 2, 3}, {0, 2, 1, 3}, {0, 3, 2, 1}}) {
    auto dataset = dataset::open_dataset({.path = data});
    ASSERT_TRUE(dataset) << dataset.error().message();
    dataset->rig = dataset->rig.subset(exchange);
    session::SessionOptions options;
    options.config.mode = execution::Mode::kSequential;
    const auto result = session::run_session(*dataset, options);
    ASSERT_TRUE(result) << result.error().message();
    EXPECT_EQ(result->record.maps_started, 0);
    EXPECT_TRUE(result->record.calibration.foreign_images());
    EXPECT_NE(session::foreign_images_text(result->record).find("so no map was started: of cameras"),
              std::string::npos);
  }
}

TEST(RealData, HasNoMotionWhileTheRigIsAtRest) {
  const std::filesystem::path data = std::filesystem::path(BSLAM_SHARED_DIR) / "data/euroc_v101_rest";
  if (!std::filesystem::is_directory(data)) GTEST_SKIP() << data << " is not present";
  const auto dataset = dataset::open_dataset({.path = data});
  ASSERT_TRUE(dataset) << dataset.error().message();
  session::SessionOptions options;
  options.config.mode = execution::Mode::kSequential;
  const auto result = session::run_session(*dataset, options);
  ASSERT_TRUE(result) << result.error().message();
  ASSERT_EQ(result->trajectories.front().poses.size(), dataset->frames.size());
  for (const evaluation::TimedPose& pose : result->trajectories.front().poses) {
    EXPECT_LT(
        (pose.T_world_frame.translation() - result->trajectories.front().poses.front().T_world_frame.translation())
            .norm(),
        0.006);
  }
}

}  // namespace
}  // namespace bslam
