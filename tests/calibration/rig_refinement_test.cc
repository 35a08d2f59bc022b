#include "calibration/rig_refinement.h"

#include <gtest/gtest.h>

#include <numbers>

#include "adjustment/map_adjustment.h"
#include "mapping/simulated_map.h"

namespace bslam::calibration {
namespace {

using geometry::SE3;

constexpr feature::FeatureModel kFeatures{.sigma_px = 0.7, .pyramid = {}};
constexpr double kDegree = std::numbers::pi / 180;

// Adds an error of one degree and one centimetre to T_cam_rig of one camera.
camera::Rig with_error(const camera::Rig& rig, std::size_t camera) {
  geometry::Vector6d error;
  error << kDegree * Eigen::Vector3d(2, -1, 2).normalized(), 0.01 * Eigen::Vector3d(-1, 2, 2).normalized();
  std::vector<camera::RigCamera> cameras;
  for (std::size_t c = 0; c < rig.size(); ++c) {
    const SE3 T_cam_rig = c == camera ? rig.cam_from_rig(c).perturbed(error) : rig.cam_from_rig(c);
    cameras.push_back({rig.camera(c), rig.body_from_cam(0) * T_cam_rig.inverse()});
  }
  return camera::Rig(std::move(cameras));
}

// Builds a map from the images of the true rig, adjusted with the given calibration.
map::SimulatedMap mapped(const camera::Rig& truth, const camera::Rig& calibrated, int keyframes, double step_s) {
  synthetic::FeatureSimulatorOptions options;
  options.landmarks = 2500;
  options.max_keypoints = 250;
  options.sigma_px = kFeatures.sigma_px;
  map::SimulatedMap out(synthetic::FeatureSimulator(truth, synthetic::make_orbit({.duration_s = 60}), options));
  out.map = map::BundledMap(std::make_shared<const camera::Rig>(calibrated));
  for (int i = 0; i < keyframes; ++i) out.add_keyframe(FrameId(i), step_s * i);
  adjustment::Selection all;
  for (const KeyframeId k : out.map.keyframe_ids())
    (k.value() == 0 ? all.fixed_keyframes : all.free_keyframes).push_back(k);
  all.landmarks = out.map.landmark_ids();
  map::MapDraft draft = out.draft();
  EXPECT_TRUE(adjustment::adjust_map(all, {}, kFeatures, draft).done);
  out.map = draft.map();
  return out;
}

double rotation_error_deg(const CameraRefinement& camera, const SE3& T_cam_rig) {
  return map::angle_rad(camera.T_cam_rig_after, T_cam_rig) / kDegree;
}

TEST(RefineRig, RecoversACameraThatWasInitiallyWrong) {
  const camera::Rig truth = synthetic::default_rig();
  // Camera 1 overlaps with camera 0; camera 3 looks to the side and overlaps with none.
  ASSERT_TRUE(truth.overlap(0, 1));
  for (std::size_t c = 0; c < 3; ++c) ASSERT_FALSE(truth.overlap(c, 3) && truth.overlap_share(c, 3) > 0.2);
  for (const std::size_t wrong : {1u, 3u}) {
    const map::SimulatedMap world = mapped(truth, with_error(truth, wrong), 30, 0.3);
    const RigRefinement result = refine_rig(world.map, {}, kFeatures);
    ASSERT_TRUE(result.done);
    ASSERT_EQ(result.cameras.size(), truth.size());
    for (std::size_t c = 0; c < truth.size(); ++c) {
      EXPECT_LT(rotation_error_deg(result.cameras[c], truth.cam_from_rig(c)), 0.1)
          << "wrong " << wrong << ", camera " << c;
      EXPECT_EQ(result.cameras[c].suspect, c == wrong)
          << "wrong " << wrong << ", camera " << c << ": " << result.cameras[c].change_deg << " deg, "
          << result.cameras[c].change_mm << " mm";
      EXPECT_TRUE(result.cameras[c].rotation_observed());
    }
    EXPECT_NEAR(result.cameras[wrong].change_deg, 1.0, 0.1);
    EXPECT_LT(result.cameras[wrong].std_deg, 0.05);
    EXPECT_GT(result.cameras[wrong].rotation_sigmas, 20);
  }
}

TEST(RefineRig, SuspectsNoCameraIfTheCalibrationIsCorrect) {
  for (const int cameras : {2, 4}) {
    const camera::Rig truth = synthetic::ring_rig(cameras);
    const RigRefinement result = refine_rig(mapped(truth, truth, 16, 0.5).map, {}, kFeatures);
    ASSERT_TRUE(result.done);
    for (const CameraRefinement& camera : result.cameras) {
      EXPECT_FALSE(camera.suspect) << camera.change_deg << " deg, " << camera.change_mm << " mm";
      EXPECT_LT(camera.change_deg, 0.1);
      EXPECT_LT(camera.rotation_sigmas, 4.5);
      EXPECT_LT(camera.translation_sigmas, 4.5);
      EXPECT_GT(camera.observations, 500);
    }
  }
}

TEST(RefineRig, RespectsItsLimitsAndFindsTheError) {
  const camera::Rig truth = synthetic::default_rig();
  const map::SimulatedMap world = mapped(truth, with_error(truth, 2), 50, 0.3);
  const RigRefinement result = refine_rig(world.map, {.keyframes = 30, .landmarks = 800}, kFeatures);
  ASSERT_TRUE(result.done);
  EXPECT_EQ(result.keyframes, 30u);
  EXPECT_LE(result.landmarks, 800u);
  EXPECT_GT(result.landmarks, 700u);
  for (std::size_t c = 0; c < truth.size(); ++c) EXPECT_GT(result.cameras[c].observations, 300) << "camera " << c;
  EXPECT_TRUE(result.cameras[2].suspect);
  EXPECT_LT(rotation_error_deg(result.cameras[2], truth.cam_from_rig(2)), 0.15);
}

// Groups of keyframes that share few landmarks are fixed separately; this must not constrain the length of the
// baseline.
TEST(RefineRig, FixingSeveralKeyframesDoesNotConstrainTheLength) {
  const camera::Rig stereo = synthetic::ring_rig(2);
  const map::SimulatedMap world = mapped(stereo, stereo, 36, 0.33);
  const RigRefinementOptions options{.keyframes = 20, .landmarks = 100};  // too few to connect all keyframes
  const RigRefinement result = refine_rig(world.map, options, kFeatures);
  ASSERT_TRUE(result.done);
  EXPECT_EQ(result.keyframes, 20u);
  EXPECT_GT(result.cameras[1].std_mm, 0.95 * options.calibration_mm);
  EXPECT_FALSE(result.cameras[1].translation_observed());
  EXPECT_TRUE(result.cameras[1].rotation_observed());
  EXPECT_FALSE(result.cameras[1].suspect);
}

TEST(RefineRig, IsNotDoneIfNotObservable) {
  const camera::Rig one = synthetic::ring_rig(1), two = synthetic::ring_rig(2);
  EXPECT_FALSE(refine_rig(mapped(one, one, 4, 0.5).map, {}, kFeatures).done);
  EXPECT_FALSE(refine_rig(map::BundledMap(std::make_shared<const camera::Rig>(two)), {}, kFeatures).done);
  map::SimulatedMap world = mapped(two, two, 4, 0.5);
  EXPECT_TRUE(refine_rig(world.map, {}, kFeatures).done);
  world.map.set_scale(map::Scale::kUpToScale);
  EXPECT_FALSE(refine_rig(world.map, {}, kFeatures).done);
}

TEST(RefineRig, IsDeterministic) {
  const camera::Rig truth = synthetic::ring_rig(3);
  const map::SimulatedMap world = mapped(truth, with_error(truth, 1), 12, 0.5);
  const RigRefinement a = refine_rig(world.map, {}, kFeatures), b = refine_rig(world.map, {}, kFeatures);
  ASSERT_TRUE(a.done);
  for (std::size_t c = 0; c < truth.size(); ++c) {
    EXPECT_EQ(a.cameras[c].T_cam_rig_after.matrix(), b.cameras[c].T_cam_rig_after.matrix());
    EXPECT_EQ(a.cameras[c].std_mm, b.cameras[c].std_mm);
  }
}

TEST(Refined, IsTheRigWithTheEstimatedExtrinsics) {
  const camera::Rig rig = synthetic::default_rig();
  RigRefinement refinement;
  EXPECT_EQ(refined(rig, refinement).cam_from_rig(1).matrix(), rig.cam_from_rig(1).matrix());
  refinement.done = true;
  const camera::Rig wanted = with_error(rig, 2);
  for (std::size_t c = 0; c < rig.size(); ++c) {
    CameraRefinement& camera = refinement.cameras.emplace_back();
    camera.T_cam_rig_after = wanted.cam_from_rig(c);
  }
  const camera::Rig out = refined(rig, refinement);
  EXPECT_EQ(out.body_from_cam(0).matrix(), rig.body_from_cam(0).matrix());
  for (std::size_t c = 0; c < rig.size(); ++c) {
    EXPECT_LT((out.cam_from_rig(c).matrix() - wanted.cam_from_rig(c).matrix()).norm(), 1e-12);
    EXPECT_EQ(out.camera(c).name, rig.camera(c).name);
  }
}

}  // namespace
}  // namespace bslam::calibration
