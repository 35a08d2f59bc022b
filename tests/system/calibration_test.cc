#include <gtest/gtest.h>

#include <numbers>

#include "system/rendered_tour.h"

namespace bslam::system {
namespace {

using geometry::SE3;

constexpr double kDegree = std::numbers::pi / 180;

// The rig with one camera rotated by a degree around its vertical axis.
camera::Rig rotated(const camera::Rig& rig, std::size_t camera) {
  geometry::Vector6d turn = geometry::Vector6d::Zero();
  turn[1] = kDegree;
  std::vector<camera::RigCamera> cameras;
  for (std::size_t c = 0; c < rig.size(); ++c) {
    const SE3 T_cam_rig = c == camera ? rig.cam_from_rig(c).perturbed(turn) : rig.cam_from_rig(c);
    cameras.push_back({rig.camera(c), rig.body_from_cam(0) * T_cam_rig.inverse()});
  }
  return camera::Rig(std::move(cameras));
}

double angle_deg(const SE3& a, const SE3& b) { return a.rotation().angularDistance(b.rotation()) / kDegree; }

// For rigs whose extrinsics alone are wrong.
Config with_exact_intrinsics(calibration::Refine refine) {
  Config config = small_config(execution::Mode::kSequential);
  config.calibration.refine = refine;
  config.calibration.sigma_focal_percent = config.calibration.sigma_aspect_percent = 0.01;
  config.calibration.sigma_centre_percent = 0.01;
  config.calibration.correlated_observations = 1;
  return config;
}

// Runs with camera 2 rotated by a degree.
void run(const RenderedTour& tour, System& system) {
  for (const image::ImageBundle& images : tour.frames()) must_process(system, images);
  system.finish();
  ASSERT_TRUE(system.calibration().done);
  const auto& found = system.calibration().cameras;
  ASSERT_EQ(found.size(), 4u);
  EXPECT_NEAR(found[2].change_deg, 1.0, 0.1);
  for (std::size_t c = 0; c < 4; ++c)
    EXPECT_EQ(found[c].suspect, c == 2) << "camera " << c << ": " << found[c].change_deg << " degrees";
}

TEST(SystemCalibration, ReportsTheRotatedCameraAndKeepsTheGivenExtrinsics) {
  const RenderedTour& tour = rendered_tour(4, 40);
  const camera::Rig wrong = rotated(tour.rig(), 2);
  System system(wrong, with_exact_intrinsics(calibration::Refine::kFalse));
  run(tour, system);
  EXPECT_FALSE(system.calibration_refined());
  EXPECT_EQ(angle_deg(system.snapshot()->rig().cam_from_rig(2), wrong.cam_from_rig(2)), 0.0);
}

TEST(SystemCalibration, UsesTheRefinedExtrinsicsForTheMap) {
  const RenderedTour& tour = rendered_tour(4, 40);
  System system(rotated(tour.rig(), 2), with_exact_intrinsics(calibration::Refine::kTrue));
  run(tour, system);
  EXPECT_TRUE(system.calibration_refined());
  for (std::size_t c = 0; c < 4; ++c) {
    // A pixel of these images is a third of a degree; camera 3, which looks sideways, is less accurate after two
    // seconds.
    EXPECT_LT(angle_deg(system.snapshot()->rig().cam_from_rig(c), tour.rig().cam_from_rig(c)), c == 3 ? 0.2 : 0.1)
        << "camera " << c;
  }
  EXPECT_EQ(system.snapshot()->check_invariants(), std::nullopt);
}

TEST(SystemCalibration, SequentialAndLaggedRunsRepeatTheirPoses) {
  const RenderedTour& tour = rendered_tour(4, 40);
  for (const execution::Mode mode : {execution::Mode::kSequential, execution::Mode::kLagged}) {
    std::vector<SubmapTrajectory> first;
    for (int repeat = 0; repeat < 2; ++repeat) {
      Config config = small_config(mode);
      config.execution.threads = repeat + 1;
      config.calibration.refine = calibration::Refine::kTrue;
      System system(rotated(tour.rig(), 2), config);
      for (const image::ImageBundle& images : tour.frames()) must_process(system, images);
      system.finish();
      EXPECT_TRUE(system.calibration_refined());
      const std::vector<SubmapTrajectory> poses = system.trajectories();
      ASSERT_FALSE(poses.empty());
      EXPECT_LT((poses.front().poses.front().T_world_frame.matrix() - Eigen::Matrix4d::Identity()).norm(), 1e-9);
      if (repeat == 0) first = poses;
      ASSERT_EQ(poses.front().poses.size(), first.front().poses.size());
      for (std::size_t i = 0; i < poses.front().poses.size(); ++i) {
        EXPECT_EQ(poses.front().poses[i].T_world_frame.matrix(), first.front().poses[i].T_world_frame.matrix());
      }
    }
  }
}

TEST(SystemCalibration, ReportsNothingIfDisabled) {
  const RenderedTour& tour = rendered_tour(2, 16);
  Config config = small_config(execution::Mode::kSequential);
  config.calibration.check = false;
  config.calibration.refine = calibration::Refine::kFalse;
  System system(tour.rig(), config);
  for (const image::ImageBundle& images : tour.frames()) must_process(system, images);
  system.finish();
  EXPECT_FALSE(system.calibration().done);
  EXPECT_FALSE(system.calibration_refined());
}

// The two cameras share no feature within the tolerance of the calibration, so that the map could not be started with
// metric scale.
TEST(SystemCalibration, ARotatedPairIsCorrectedBeforeTheStart) {
  const RenderedTour& tour = rendered_tour(2, 20);
  geometry::Vector6d turn = geometry::Vector6d::Zero();
  turn[0] = 3 * kDegree;  // across the epipolar planes
  const camera::Rig& rig = tour.rig();
  const camera::Rig wrong({{rig.camera(0), rig.body_from_cam(0)},
                           {rig.camera(1), rig.body_from_cam(0) * rig.cam_from_rig(1).perturbed(turn).inverse()}});
  for (const auto refine : {calibration::Refine::kAuto, calibration::Refine::kFalse}) {
    Config config = small_config(execution::Mode::kParallel);
    config.calibration.refine = refine;
    System system(wrong, config);
    for (const image::ImageBundle& images : tour.frames()) must_process(system, images);
    system.finish();
    const bool corrected = refine != calibration::Refine::kFalse;
    EXPECT_EQ(angle_deg(system.snapshot()->rig().cam_from_rig(1), rig.cam_from_rig(1)) < 0.5, corrected);
    if (!corrected) continue;
    EXPECT_EQ(tracked_frames(system), tour.frames().size());
    EXPECT_EQ(system.snapshot()->scale(), map::Scale::kMetric);
    System again(wrong, config, {.replay = system.journal()});
    for (const image::ImageBundle& images : tour.frames()) must_process(again, images);
    again.finish();
    EXPECT_TRUE(identical(system.trajectories(), again.trajectories()));
  }
}

}  // namespace
}  // namespace bslam::system
