#include "calibration/unobserved_cameras.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "calibration/adjusted_map.h"
#include "calibration/deviation.h"
#include "calibration/joint_refinement.h"
#include "tracking/camera_consensus.h"

namespace bslam::calibration {
namespace {

constexpr feature::FeatureModel kFeatures{.sigma_px = 0.7, .pyramid = {}};
const CalibrationOptions kIndependent{.correlated_observations = 1};
constexpr std::size_t kHardlySeen = 3;

// The estimate from a map in which one camera has images in a single keyframe. The principal point of camera 0 is wrong
// by some pixels.
struct HardlySeen {
  camera::Rig truth = synthetic::default_rig(), calibrated = truth;
  RigRefinement result;

  explicit HardlySeen(std::uint64_t seed = 1) {
    solver::RigValues values = solver::RigValues::of(truth);
    camera::ModelParameters parameters = camera::parameters(values.models[0]);
    parameters(2) += 8;
    values.models[0] = camera::with_parameters(values.models[0], parameters);
    calibrated = values.applied_to(truth);
    synthetic::FeatureSimulatorOptions options;
    options.noise_seed = seed;
    options.landmarks = 2500;
    options.max_keypoints = 250;
    options.sigma_px = kFeatures.sigma_px;
    map::SimulatedMap world({truth, synthetic::make_orbit({.duration_s = 60}), options});
    world.map = map::BundledMap(std::make_shared<const camera::Rig>(calibrated));
    for (int i = 0; i < 20; ++i) {
      world.change_frame = [&](auto& frame) {
        if (i != 9) tracking::remove_camera(truth, kHardlySeen, 0.01, 16, frame);
      };
      world.add_keyframe(FrameId(i), 0.3 * i);
    }
    result = refine_rig(map::adjusted(world, kFeatures), calibrated, kIndependent, kFeatures);
  }
};

double largest_angle_deg(const geometry::SE3& a, const geometry::SE3& b) {
  return geometry::degrees(a.rotation().angularDistance(b.rotation()));
}

TEST(UnobservedCameras, HaveTheDeviationsOfTheCalibration) {
  const HardlySeen seen;
  ASSERT_TRUE(seen.result.done);
  const CameraRefinement& camera = seen.result.cameras[kHardlySeen];
  ASSERT_GT(camera.observations, 15);
  ASSERT_LT(camera.observations, kMinCameraObservations);
  EXPECT_EQ(camera.observed, (std::array<bool, 6>{}));
  EXPECT_NEAR(camera.std_deg, kIndependent.sigma_rotation_deg, 1e-4);
  EXPECT_FALSE(camera.suspect);
  EXPECT_TRUE(seen.result.cameras[1].rotation_observed());
  // The information has the same deviations.
  const RigInformation& information = seen.result.information;
  const Eigen::MatrixXd covariance = information.information.llt().solve(
      Eigen::MatrixXd::Identity(information.change.size(), information.change.size()));
  for (std::size_t c = 1; c < 4; ++c) {
    const Eigen::Matrix3d turn = covariance.block<3, 3>(6 * (static_cast<int>(c) - 1), 6 * (static_cast<int>(c) - 1));
    EXPECT_NEAR(geometry::degrees(largest_deviation(turn)), seen.result.cameras[c].std_deg,
                1e-6 * seen.result.cameras[c].std_deg)
        << c;
  }
}

// Two recordings of which none shows the camera do not show it together either.
TEST(UnobservedCameras, FollowCamera0IfRecordingsAreCombined) {
  const HardlySeen first, second(2);
  ASSERT_TRUE(first.result.done && second.result.done);
  const auto joint = combine(first.calibrated, std::vector{first.result, second.result});
  ASSERT_TRUE(joint.has_value());
  for (const CalibratedValue& value : joint->cameras[kHardlySeen].extrinsics) EXPECT_FALSE(value.observed);
  EXPECT_NEAR(geometry::degrees(joint->cameras[kHardlySeen].extrinsics[1].std), kIndependent.sigma_rotation_deg, 1e-4);
  const geometry::SE3 expected = unobserved_extrinsics(first.calibrated, kHardlySeen, joint->rig.camera(0u).model);
  EXPECT_LT(largest_angle_deg(joint->rig.cam_from_rig(kHardlySeen), expected), 1e-6);
  EXPECT_GT(largest_angle_deg(joint->rig.cam_from_rig(kHardlySeen), first.calibrated.cam_from_rig(kHardlySeen)), 0.1);
}

}  // namespace
}  // namespace bslam::calibration
