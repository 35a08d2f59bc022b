#include "calibration/image_equations.h"

#include <gtest/gtest.h>

#include <numbers>
#include <vector>

#include "base/random.h"
#include "calibration/adjusted_map.h"
#include "calibration/rig_refinement.h"
#include "mapping/simulated_map.h"

namespace bslam::calibration::image_noise {
namespace {

using geometry::SE3;

constexpr feature::FeatureModel kFeatures{.sigma_px = 0.5, .pyramid = {}};
constexpr double kDegree = std::numbers::pi / 180;
constexpr int kKeyframes = 20;
constexpr double kStep_s = 0.3;

// A rig whose cameras but the first are turned by normal random angles about their three axes.
camera::Rig with_turned_cameras(const camera::Rig& rig, double sigma_deg, Random& random) {
  std::vector<camera::RigCamera> cameras = {{rig.camera(0), rig.body_from_cam(0)}};
  for (std::size_t c = 1; c < rig.size(); ++c) {
    const Eigen::Vector3d turn(random.normal(), random.normal(), random.normal());
    cameras.push_back(
        {rig.camera(c), rig.body_from_cam(c) * SE3(geometry::so3_exp(sigma_deg * kDegree * turn), {0, 0, 0})});
  }
  return camera::Rig(std::move(cameras));
}

// A map whose images were taken by cameras that are turned by other random angles in each keyframe, and by the same
// ones, of deviation `moved_deg`, in all keyframes from the middle of the recording on.
map::BundledMap map_of(const camera::Rig& rig, double sigma_deg, double moved_deg = 0) {
  Random random(1);
  map::SimulatedMap out(map::orbit_simulator(rig, kFeatures));
  for (int i = 0; i < kKeyframes; ++i) {
    camera::Rig now = with_turned_cameras(rig, sigma_deg, random);
    if (i >= kKeyframes / 2 && moved_deg > 0) {
      Random same(2);
      now = with_turned_cameras(now, moved_deg, same);
    }
    out.sim = map::orbit_simulator(now, kFeatures);
    out.add_keyframe(FrameId(i), kStep_s * i);
  }
  return map::adjusted(out, kFeatures);
}

double correlation(const map::BundledMap& map) {
  RigProblem problem = choose(map, false, {}, kFeatures);
  return correlation_in_images(map, problem, solver::RigValues::of(map.rig().in_frame_of_camera_0()));
}

TEST(ImageEquations, ErrorsOfTheImagesOfARigidRigAreIndependent) {
  const camera::Rig rig = synthetic::default_rig();
  EXPECT_LT(correlation(map_of(rig, 0)), 1.5);
  // Camera poses that change once are not noise of the images.
  EXPECT_LT(correlation(map_of(rig, 0, 0.3)), 3);
}

TEST(ImageEquations, ErrorsOfImagesWhoseCamerasAreDisplacedAreCorrelated) {
  const camera::Rig rig = synthetic::default_rig();
  const double little = correlation(map_of(rig, 0.05)), more = correlation(map_of(rig, 0.1));
  EXPECT_GT(little, 3);
  EXPECT_GT(more, 2 * little);
  EXPECT_LT(more, 250);  // observations of an image
}

TEST(ImageEquations, OfAMoveHaveItsChange) {
  const camera::Rig rig = synthetic::default_rig();
  const map::BundledMap map = map_of(rig, 0);
  const RigProblem problem = choose(map, false, {}, kFeatures);
  solver::RigValues values = solver::RigValues::of(map.rig().in_frame_of_camera_0());
  const std::size_t cameras = rig.size(), c = 2;
  const std::vector<ImageEquations> right = image_equations(problem, values);
  values.T_cam_rig[c] = SE3(geometry::so3_exp({0, -0.2 * kDegree, 0}), {0, 0, 0}) * values.T_cam_rig[c];
  const std::vector<ImageEquations> wrong = image_equations(problem, values);
  ASSERT_EQ(right.size(), cameras * static_cast<std::size_t>(kKeyframes));
  ImageEquations all, after;
  for (std::size_t pose = 0; pose < static_cast<std::size_t>(kKeyframes); ++pose) {
    const ImageEquations& image = (pose < 10 ? right : wrong)[pose * cameras + c];
    all.add(image);
    if (pose >= 10) after.add(image);
  }
  EXPECT_EQ(all.keyframes, kKeyframes);
  const auto [change, decrease] = best_change(all, after);
  EXPECT_NEAR(geometry::degrees(change(1)), 0.2, 0.02);
  EXPECT_GT(decrease, 1000);
}

// Random errors of whole images neither contradict a calibration nor look like moves, and the estimate knows less.
TEST(ImageEquations, CorrelatedErrorsDoNotContradictTheCalibration) {
  const camera::Rig rig = synthetic::default_rig();
  const CalibrationOptions independent{.correlated_observations = 1};
  const RigRefinement still = refine_rig(map_of(rig, 0), rig, independent, kFeatures),
                      shaken = refine_rig(map_of(rig, 0.1), rig, independent, kFeatures);
  ASSERT_TRUE(still.done && shaken.done);
  EXPECT_EQ(shaken.verdict, Verdict::kConsistent) << shaken.excess_error;
  EXPECT_TRUE(shaken.moves.empty());
  for (std::size_t c = 1; c < rig.size(); ++c) {
    EXPECT_GT(shaken.cameras[c].std_deg, 2 * still.cameras[c].std_deg) << c;
    EXPECT_LT(shaken.cameras[c].rotation_sigmas, 5) << c;
    EXPECT_LT(shaken.cameras[c].translation_sigmas, 5) << c;
  }
}

}  // namespace
}  // namespace bslam::calibration::image_noise
