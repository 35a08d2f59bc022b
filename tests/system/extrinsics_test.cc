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

// Runs with camera 2 rotated by a degree.
void run(const RenderedTour& tour, System& system) {
  for (const image::ImageBundle& images : tour.frames()) must_process(system, images);
  system.finish();
  ASSERT_TRUE(system.extrinsics().done);
  const auto& found = system.extrinsics().cameras;
  ASSERT_EQ(found.size(), 4u);
  EXPECT_NEAR(found[2].change_deg, 1.0, 0.1);
  for (std::size_t c = 0; c < 4; ++c)
    EXPECT_EQ(found[c].suspect, c == 2) << "camera " << c << ": " << found[c].change_deg << " degrees";
}

TEST(SystemExtrinsics, ReportsTheRotatedCameraAndKeepsTheGivenExtrinsics) {
  const RenderedTour tour(4, 40);
  const camera::Rig wrong = rotated(tour.rig(), 2);
  System system(wrong, small_config(execution::Mode::kSequential));
  run(tour, system);
  EXPECT_FALSE(system.extrinsics_refined());
  EXPECT_EQ(angle_deg(system.snapshot()->rig().cam_from_rig(2), wrong.cam_from_rig(2)), 0.0);
}

TEST(SystemExtrinsics, UsesTheRefinedExtrinsicsForTheMap) {
  const RenderedTour tour(4, 40);
  Config config = small_config(execution::Mode::kSequential);
  config.extrinsics.refine = true;
  System system(rotated(tour.rig(), 2), config);
  run(tour, system);
  EXPECT_TRUE(system.extrinsics_refined());
  for (std::size_t c = 0; c < 4; ++c) {
    // A pixel of these images is a third of a degree; camera 3, which looks sideways, is less accurate after two
    // seconds.
    EXPECT_LT(angle_deg(system.snapshot()->rig().cam_from_rig(c), tour.rig().cam_from_rig(c)), c == 3 ? 0.2 : 0.1)
        << "camera " << c;
  }
  EXPECT_EQ(system.snapshot()->check_invariants(), std::nullopt);
}

TEST(SystemExtrinsics, ReportsNothingIfDisabled) {
  const RenderedTour tour(2, 16);
  Config config = small_config(execution::Mode::kSequential);
  config.extrinsics.check = false;
  System system(tour.rig(), config);
  for (const image::ImageBundle& images : tour.frames()) must_process(system, images);
  system.finish();
  EXPECT_FALSE(system.extrinsics().done);
  EXPECT_FALSE(system.extrinsics_refined());
}

}  // namespace
}  // namespace bslam::system
