#include "tracking/view_rotation.h"

#include <gtest/gtest.h>

#include "geometry/so3.h"
#include "tracking/simulated_tracker.h"

namespace bslam::tracking {
namespace {

using Eigen::Vector3d;

// Directions within 40 degrees of the optical axis, of which `right` are rotated and the others are anywhere.
std::vector<DirectionPair> rotated_pairs(const Vector3d& omega, int right, int wrong) {
  Random random(3, "view rotation");
  const auto direction = [&] { return Vector3d(random.uniform(-0.8, 0.8), random.uniform(-0.8, 0.8), 1).normalized(); };
  std::vector<DirectionPair> out;
  for (int i = 0; i < right; ++i) {
    const Vector3d predicted = direction();
    out.push_back({predicted, geometry::so3_exp(omega) * predicted});
  }
  for (int i = 0; i < wrong; ++i) out.push_back({direction(), direction()});
  return out;
}

TEST(ViewRotation, IsThatOfMostPairs) {
  const Vector3d omega(0.02, -0.03, 0.01);
  const ViewRotation found = view_rotation(rotated_pairs(omega, 30, 20));
  EXPECT_NEAR(found.angle, omega.norm(), 0.002);
  EXPECT_GE(found.agree, 30);
  EXPECT_LT(found.agree, 33);
}

TEST(ViewRotation, HasFewAgreeingPairsInAnotherScene) {
  EXPECT_LT(view_rotation(rotated_pairs(Vector3d::Zero(), 0, 100)).agree, 10);
  EXPECT_EQ(view_rotation({}).agree, 0);
}

// A frame in which the view of camera 2 is rotated about its vertical axis.
frame::BundledFrame with_rotated_view(const map::SimulatedMap& world, int i, double angle) {
  frame::BundledFrame frame = world.sim.frame(FrameId(i), 0.05 * i).frame;
  const camera::Rig& rig = world.map.rig();
  const Eigen::Matrix3d R = geometry::so3_exp({0, angle, 0}).toRotationMatrix();
  frame::CameraFrame& camera = frame.cameras[2];
  feature::Refinement positions = camera.keypoints.positions();
  for (std::size_t k = 0; k < camera.keypoints.size(); ++k) {
    const auto pixel = rig.camera(2).project(R * positions.bearing[k]);
    if (!pixel || !rig.camera(2).contains(*pixel)) continue;
    positions.bearing[k] = R * positions.bearing[k];
    positions.pixel[k] = pixel->cast<float>();
  }
  camera = frame::refined(camera, std::move(positions), rig.camera(2));
  frame.bundled = matching::make_bundled(rig, frame.cameras, {}, 5e-4, 7.81);
  return frame;
}

TEST(ViewRotation, ByASmallAngleIsNoReasonToExcludeACameraInANewMap) {
  const map::SimulatedMap world = true_map(simulator(synthetic::default_rig()), 2.0, 0.25);
  for (const double degrees : {1.0, 6.0}) {
    SimulatedTracker tracker(world);
    tracker.options.matching.predicted_radius = 0.15;
    for (int i = 1; i < 20; ++i) {
      const auto frame = with_rotated_view(world, i, i < 5 ? 0.0 : degrees * kDegree);
      const TrackOutput out = tracker.track(frame);
      ASSERT_EQ(out.result.status, TrackStatus::kTracking) << i;
      const bool small = degrees < ConsensusOptions{}.max_calibration_error_deg;
      EXPECT_EQ(out.result.cameras[2].excluded, i >= 5 && !small) << degrees << " degrees, frame " << i;
      for (const std::size_t c : {0, 1, 3}) EXPECT_FALSE(out.result.cameras[c].excluded) << "camera " << c;
    }
  }
}

}  // namespace
}  // namespace bslam::tracking
