#include "calibration/rig_refinement.h"

#include <gtest/gtest.h>

#include <numbers>

#include "base/random.h"
#include "calibration/adjusted_map.h"
#include "calibration/calibration_prior.h"
#include "calibration/path_scale.h"
#include "camera/model_parameters.h"
#include "geometry/triangulation.h"
#include "mapping/simulated_map.h"
#include "solver/rig_block.h"
#include "tracking/camera_consensus.h"

namespace bslam::calibration::refinement {
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
map::SimulatedMap mapped(const camera::Rig& truth, const camera::Rig& calibrated, int keyframes, double step_s,
                         const synthetic::Trajectory& trajectory = synthetic::make_orbit({.duration_s = 60}),
                         std::optional<std::size_t> missing_camera = {}) {
  synthetic::FeatureSimulatorOptions options;
  options.landmarks = 2500;
  options.max_keypoints = 250;
  options.sigma_px = kFeatures.sigma_px;
  map::SimulatedMap out(synthetic::FeatureSimulator(truth, trajectory, options));
  out.map = map::BundledMap(std::make_shared<const camera::Rig>(calibrated));
  if (missing_camera)
    out.change_frame = [&](auto& frame) { tracking::remove_camera(truth, *missing_camera, 0.01, 16, frame); };
  for (int i = 0; i < keyframes; ++i) out.add_keyframe(FrameId(i), step_s * i);
  out.map = map::adjusted(out, kFeatures);
  out.change_frame = {};
  return out;
}

// The estimate from a map that was built with the calibration of its rig.
RigRefinement refine(const map::BundledMap& map, const CalibrationOptions& options = {}) {
  return refine_rig(map, map.rig(), options, kFeatures);
}

// Relative to camera 0, which an estimate of its principal point turns in the rig frame.
double rotation_error_deg(const RigRefinement& result, std::size_t camera, const camera::Rig& truth) {
  const SE3 T_cam_cam0 = result.rig->cam_from_rig(camera) * result.rig->rig_from_cam(0);
  return map::angle_rad(T_cam_cam0, truth.cam_from_rig(camera)) / kDegree;
}

// Simulated observations are independent, and the intrinsics of these rigs are exact unless a test changes them.
const CalibrationOptions kIndependent{.correlated_observations = 1};
const CalibrationOptions kExactIntrinsics{.sigma_focal_percent = 1e-3,
                                          .sigma_aspect_percent = 1e-3,
                                          .sigma_centre_percent = 1e-3,
                                          .correlated_observations = 1};

TEST(RefineRig, RecoversACameraThatWasInitiallyWrong) {
  const camera::Rig truth = synthetic::default_rig();
  // Camera 1 overlaps with camera 0; camera 3 looks to the side and overlaps with none.
  ASSERT_TRUE(truth.overlap(0, 1));
  for (std::size_t c = 0; c < 3; ++c) ASSERT_FALSE(truth.overlap(c, 3) && truth.overlap_share(c, 3) > 0.2);
  for (const std::size_t wrong : {1u, 3u}) {
    const map::SimulatedMap world = mapped(truth, with_error(truth, wrong), 30, 0.3);
    const RigRefinement result = refine(world.map, kExactIntrinsics);
    ASSERT_TRUE(result.done);
    ASSERT_EQ(result.cameras.size(), truth.size());
    for (std::size_t c = 0; c < truth.size(); ++c) {
      EXPECT_LT(rotation_error_deg(result, c, truth), 0.1) << "wrong " << wrong << ", camera " << c;
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
    const RigRefinement result = refine(mapped(truth, truth, 16, 0.5).map);
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
  const RigRefinement result = refine(world.map, {.keyframes = 30, .landmarks = 800});
  ASSERT_TRUE(result.done);
  EXPECT_EQ(result.keyframes, 30u);
  EXPECT_LE(result.landmarks, 800u);
  EXPECT_GT(result.landmarks, 700u);
  for (std::size_t c = 0; c < truth.size(); ++c) EXPECT_GT(result.cameras[c].observations, 300) << "camera " << c;
  EXPECT_TRUE(result.cameras[2].suspect);
  EXPECT_LT(rotation_error_deg(result, 2, truth), 0.15);
}

// Groups of keyframes that share few landmarks are fixed separately; this must not constrain the length of the
// baseline.
TEST(RefineRig, FixingSeveralKeyframesDoesNotConstrainTheLength) {
  const camera::Rig stereo = synthetic::ring_rig(2);
  const map::SimulatedMap world = mapped(stereo, stereo, 36, 0.33);
  // too few landmarks to connect all keyframes, and no prior of the length
  const CalibrationOptions options{
      .keyframes = 20, .landmarks = 100, .sigma_depth_mm = 0, .sigma_scale_percent = 100, .correlated_observations = 1};
  const RigRefinement result = refine(world.map, options);
  ASSERT_TRUE(result.done);
  EXPECT_EQ(result.keyframes, 20u);
  EXPECT_GT(result.cameras[1].std_mm, 0.95e3 * translation_deviation(stereo, options));
  EXPECT_FALSE(result.cameras[1].translation_observed());
  EXPECT_TRUE(result.cameras[1].rotation_observed());
  EXPECT_FALSE(result.cameras[1].suspect);
}

TEST(RefineRig, IsNotDoneIfNotObservable) {
  const camera::Rig one = synthetic::ring_rig(1), two = synthetic::ring_rig(2);
  EXPECT_FALSE(refine(map::BundledMap(std::make_shared<const camera::Rig>(one))).done);
  EXPECT_FALSE(refine(map::BundledMap(std::make_shared<const camera::Rig>(two))).done);
  map::SimulatedMap world = mapped(two, two, 4, 0.5);
  EXPECT_TRUE(refine(world.map).done);
  world.map.set_scale(map::Scale::kUpToScale);
  EXPECT_FALSE(refine(world.map).done);
}

// Without any rotation, images do not reveal where a camera is that shares no landmarks with others. Neither a right
// nor a wrong position may be replaced by an invented one.
TEST(RefineRig, OnAStraightLineWhatIsNotObservableStaysAsItWas) {
  std::vector<synthetic::ControlPose> control;
  for (int i = 0; i < 8; ++i) control.push_back({{0.1 * i, 0.3, 1.5}, 0.0, 0.0, 0.0});
  const synthetic::Trajectory straight(std::move(control), 1.0);
  const camera::Rig truth = synthetic::default_rig();
  for (const bool wrong : {false, true}) {
    const camera::Rig given = wrong ? with_error(truth, 3) : truth;
    const RigRefinement result = refine(mapped(truth, given, 10, 0.5, straight).map, kIndependent);
    ASSERT_TRUE(result.done);
    for (std::size_t c = 0; c < truth.size(); ++c) {
      const CameraRefinement& camera = result.cameras[c];
      EXPECT_FALSE(c >= 2 && camera.translation_observed()) << c;
      EXPECT_LT(camera.translation_sigmas, 3.5) << c << (wrong ? ", wrong" : "");
      EXPECT_LT(camera.rotation_sigmas, 3.5) << c << (wrong ? ", wrong" : "");
      EXPECT_FALSE(camera.suspect) << c << (wrong ? ", wrong" : "");
      for (const ParameterRefinement& parameter : camera.intrinsics)
        EXPECT_LT(std::abs(parameter.change), 3 * parameter.std) << c << ' ' << parameter.name;
    }
    EXPECT_GT(result.cameras[3].std_mm, 0.6 * CalibrationOptions().sigma_depth_mm);
    EXPECT_TRUE(wrong || result.verdict == Verdict::kConsistent);
  }
}

TEST(RefineRig, IsDeterministic) {
  const camera::Rig truth = synthetic::ring_rig(3);
  const map::SimulatedMap world = mapped(truth, with_error(truth, 1), 12, 0.5);
  const RigRefinement a = refine(world.map), b = refine(world.map);
  ASSERT_TRUE(a.done);
  for (std::size_t c = 0; c < truth.size(); ++c) {
    EXPECT_EQ(a.rig->cam_from_rig(c).matrix(), b.rig->cam_from_rig(c).matrix());
    EXPECT_EQ(a.cameras[c].std_mm, b.cameras[c].std_mm);
  }
}

// The rig with focal lengths that are half a per cent too long and principal points that are three pixels off.
camera::Rig with_wrong_intrinsics(const camera::Rig& rig) {
  solver::RigValues values = solver::RigValues::of(rig);
  for (camera::CameraModel& model : values.models) {
    camera::ModelParameters p = camera::parameters(model);
    p.head<2>() *= 1.005;
    p.segment<2>(2) += Eigen::Vector2d(3, -3);
    model = camera::with_parameters(model, p);
  }
  return values.applied_to(rig);
}

TEST(RefineRig, TellsAWrongCalibrationFromARightOne) {
  const camera::Rig truth = synthetic::default_rig(), wrong = with_wrong_intrinsics(truth);
  const RigRefinement of_right = refine(mapped(truth, truth, 30, 0.3).map);
  ASSERT_TRUE(of_right.done);
  EXPECT_EQ(of_right.verdict, Verdict::kConsistent) << of_right.excess_error;
  EXPECT_FALSE(accepted(of_right, {}));
  EXPECT_TRUE(accepted(of_right, {.refine = Refine::kTrue}));
  const RigRefinement of_wrong = refine(mapped(truth, wrong, 30, 0.3).map, kIndependent);
  ASSERT_TRUE(of_wrong.done);
  EXPECT_EQ(of_wrong.verdict, Verdict::kInconsistent) << of_wrong.excess_error;
  EXPECT_TRUE(accepted(of_wrong, {}));
  EXPECT_FALSE(accepted(of_wrong, {.refine = Refine::kFalse}));
  for (std::size_t c = 0; c < truth.size(); ++c) {
    const double focal = camera::intrinsics(truth.camera(c).model).fx;
    EXPECT_NEAR(camera::intrinsics(of_wrong.rig->camera(c).model).fx, focal, 0.0015 * focal) << "camera " << c;
  }
}

// The intrinsics of a single camera do not depend on the scale of its map, which is arbitrary.
TEST(RefineRig, CalibratesASingleCamera) {
  const camera::Rig truth = synthetic::ring_rig(1);
  const camera::Rig wrong({{camera::zoomed(truth.camera(0), 1.03), truth.body_from_cam(0)}});
  const auto estimate = [&](const camera::Rig& given) {
    map::SimulatedMap world = mapped(truth, given, 30, 0.3);
    world.map.set_scale(map::Scale::kUpToScale);
    return refine(world.map, {.correlated_observations = 1, .inconsistent_excess = 0.01});
  };
  const RigRefinement of_right = estimate(truth), of_wrong = estimate(wrong);
  ASSERT_TRUE(of_right.done && of_wrong.done);
  EXPECT_EQ(of_right.verdict, Verdict::kConsistent) << of_right.excess_error;
  EXPECT_EQ(of_wrong.verdict, Verdict::kInconsistent) << of_wrong.excess_error;
  EXPECT_TRUE(of_wrong.moves.empty());
  for (const RigRefinement& r : {of_right, of_wrong}) {
    const camera::ModelParameters error =
        camera::parameters(r.rig->camera(0).model) - camera::parameters(truth.camera(0).model);
    for (std::size_t k = 0; k < r.cameras[0].intrinsics.size(); ++k) {
      const ParameterRefinement& parameter = r.cameras[0].intrinsics[k];
      EXPECT_LT(std::abs(error(static_cast<Eigen::Index>(k))), 4 * parameter.std) << parameter.name;
    }
  }
  EXPECT_LT(of_wrong.cameras[0].intrinsics[0].std, 0.005 * camera::intrinsics(truth.camera(0).model).fx);
  EXPECT_TRUE(replaced(*of_wrong.rig, wrong));
  EXPECT_FALSE(replaced(wrong, wrong));
}

// The same rig with a principal point of camera 0 that is wrong by 12 px, and the extrinsics that a calibration finds
// then: all relative to the axes that camera 0 seems to have.
camera::Rig with_wrong_centre(const camera::Rig& truth) {
  camera::Camera camera = truth.camera(0);
  camera::ModelParameters parameters = camera::parameters(camera.model);
  parameters(2) += 12;
  camera.model = camera::with_parameters(camera.model, parameters);
  const Eigen::Vector2d centre(0.5 * camera.width, 0.5 * camera.height);
  const SE3 R_true_seeming(
      Eigen::Quaterniond::FromTwoVectors(*camera.unproject(centre), *truth.camera(0).unproject(centre)),
      Eigen::Vector3d::Zero());
  std::vector<camera::RigCamera> cameras = {{camera, truth.body_from_cam(0)}};
  for (std::size_t c = 1; c < truth.size(); ++c)
    cameras.push_back({truth.camera(c), truth.body_from_cam(0) * (truth.cam_from_rig(c) * R_true_seeming).inverse()});
  return camera::Rig(std::move(cameras));
}

TEST(RefineRig, ACameraWithoutImagesFollowsTheIntrinsicsOfCamera0) {
  const camera::Rig truth = synthetic::default_rig(), calibrated = with_wrong_centre(truth);
  ASSERT_GT(map::angle_rad(calibrated.cam_from_rig(3), truth.cam_from_rig(3)) / kDegree, 1.0);
  const RigRefinement result =
      refine(mapped(truth, calibrated, 30, 0.3, synthetic::make_orbit({.duration_s = 60}), 3).map, kIndependent);
  ASSERT_TRUE(result.done);
  ASSERT_EQ(result.cameras[3].observations, 0);
  for (std::size_t c = 0; c < truth.size(); ++c)
    EXPECT_LT(rotation_error_deg(result, c, truth), 0.25) << "camera " << c;
  // The rig frame keeps the directions of the pixels, as far as the estimate of their rays allows.
  const camera::Camera &before = calibrated.camera(0), &after = result.rig->camera(0);
  const Eigen::Vector2d centre(0.5 * before.width, 0.5 * before.height);
  const Eigen::Vector3d ray = result.rig->rig_from_cam(0).rotation() * *after.unproject(centre);
  EXPECT_LT(geometry::angle_between(ray, *before.unproject(centre)) / kDegree, 0.1);
  EXPECT_GT(geometry::angle_between(*after.unproject(centre), *before.unproject(centre)) / kDegree, 1.0);
  EXPECT_TRUE(result.rig->body_from_rig().matrix().isApprox(calibrated.body_from_cam(0).matrix(), 1e-9));
}

TEST(RefineRig, ARefinedMapUsesTheEstimateAndKeepsItsInvariants) {
  const camera::Rig truth = synthetic::default_rig();
  map::SimulatedMap world = mapped(truth, with_wrong_intrinsics(truth), 20, 0.3);
  const RigRefinement estimate = refine(world.map);
  ASSERT_TRUE(estimate.done);
  map::MapDraft draft = world.draft();
  apply(estimate, draft);
  EXPECT_TRUE(draft.map().rig().same_calibration(*estimate.rig));
  EXPECT_EQ(draft.map().check_invariants(), std::nullopt);
  ASSERT_TRUE(draft.map().rig_deviation());
  const Eigen::MatrixXd& L = *draft.map().rig_deviation();
  EXPECT_TRUE((L * L.transpose() * estimate.information.information).isIdentity(1e-6));
  const KeyframeId k = draft.map().newest_keyframe();
  const feature::Keypoints& keypoints = draft.map().keypoints(k, CameraIndex(0));
  const auto bearing = estimate.rig->camera(0).unproject(keypoints.pixel[0].cast<double>());
  ASSERT_TRUE(bearing);
  EXPECT_EQ(keypoints.bearing[0], *bearing);
}

TEST(MoveSubmap, TheDisplacementOfTheRootIsAnErrorOfAllKeyframes) {
  const camera::Rig truth = synthetic::default_rig();
  map::SimulatedMap world = mapped(truth, truth, 4, 0.3);
  const KeyframeId root(0), last(3);
  const geometry::PoseUncertainty own{2e-4 * geometry::Matrix6d::Identity(), 1e-3 * geometry::Matrix6d::Identity()};
  world.map.set_pose(root, geometry::SE3());
  world.map.set_uncertainty(last, own);
  const geometry::SE3 T_last_world = world.map.keyframe(last).T_rig_world;
  geometry::Vector6d step;
  step << 0.01, 0.02, -0.03, 0.1, 0.2, 0.3;
  map::MapDraft draft = world.draft();
  move_submap(last, T_last_world * geometry::SE3::exp(step), draft);
  EXPECT_LT((draft.map().keyframe(root).T_rig_world.log() - step).norm(), 1e-12);
  const auto expect_near = [&](KeyframeId k, const geometry::PoseUncertainty& expected) {
    const geometry::PoseUncertainty& found = draft.map().keyframe(k).uncertainty;
    EXPECT_LT((found.noise - expected.noise).norm(), 1e-12);
    EXPECT_LT((geometry::sum(found.calibration, -expected.calibration)).norm(), 1e-12);
  };
  const geometry::PoseUncertainty of_root{step * step.transpose()};
  expect_near(root, of_root);
  expect_near(last, own + geometry::transported(of_root, T_last_world));
  move_submap(root, geometry::SE3(), draft);
  expect_near(root, {});
  expect_near(last, own);
}

// The estimate is a map of another scale, as if the images had distributed it otherwise over the baselines.
RigRefinement scaled(RigRefinement estimate, double factor) {
  std::vector<camera::RigCamera> cameras;
  for (std::size_t c = 0; c < estimate.rig->size(); ++c) {
    cameras.push_back({estimate.rig->camera(c), estimate.rig->body_from_cam(0) *
                                                    geometry::scaled(estimate.rig->cam_from_rig(c), factor).inverse()});
  }
  estimate.rig = camera::Rig(std::move(cameras));
  for (auto& [keyframe, T] : estimate.poses.keyframes) T = geometry::scaled(T, factor);
  for (auto& [landmark, position] : estimate.poses.landmarks) position *= factor;
  estimate.scale_change *= factor;
  return estimate;
}

double path_length(const map::BundledMap& map) {
  double sum = 0;
  const std::vector<KeyframeId> ids = map.keyframe_ids();
  for (std::size_t i = 1; i < ids.size(); ++i)
    sum += map::distance_m(map.keyframe(ids[i]).T_rig_world, map.keyframe(ids[i - 1]).T_rig_world);
  return sum;
}

TEST(KeepScale, TheMapKeepsItsScaleUnlessTheBaselinesDifferTooMuch) {
  const camera::Rig truth = synthetic::default_rig();
  map::SimulatedMap world = mapped(truth, with_wrong_intrinsics(truth), 20, 0.3);
  const RigRefinement estimate = refine(world.map);
  ASSERT_TRUE(estimate.done);
  const double before = path_length(world.map);
  struct Case {
    double factor, deviation;
    bool keeps;
  };
  for (const auto& [factor, deviation, keeps] : {Case{0.988, 0, true}, Case{1.012, 0, true}, Case{1.02, 0, false},
                                                 Case{1.02, 0.03, true}, Case{1.1, 0.3, false}}) {
    RigRefinement kept = scaled(estimate, factor / estimate.scale_change);  // changes the path by `factor`
    kept.scale_deviation = deviation;
    keep_scale({}, kept);
    map::MapDraft draft = world.draft();
    apply(kept, draft);
    EXPECT_NEAR(path_length(draft.map()) / before, keeps ? 1.0 : factor, 2e-3) << factor;
    EXPECT_NEAR(kept.rig->cam_from_rig(1).translation().norm() / estimate.rig->cam_from_rig(1).translation().norm(),
                (keeps ? 1.0 : factor) / estimate.scale_change, 1e-9);
    EXPECT_NEAR(kept.scale_change, keeps ? 1.0 : factor, 1e-12);
  }
}

TEST(KeepScale, TheMapOfASingleCameraAlwaysKeepsItsScale) {
  const camera::Rig truth = synthetic::ring_rig(1);
  map::SimulatedMap world = mapped(truth, with_wrong_intrinsics(truth), 20, 0.3);
  const RigRefinement estimate = refine(world.map);
  ASSERT_TRUE(estimate.done);
  RigRefinement kept = scaled(estimate, 1.2 / estimate.scale_change);
  keep_scale({}, kept);
  EXPECT_NEAR(kept.scale_change, 1.0, 1e-12);
  map::MapDraft draft = world.draft();
  const double before = path_length(world.map);
  apply(kept, draft);
  EXPECT_NEAR(path_length(draft.map()) / before, 1.0, 2e-3);
}

double true_path_length(const map::SimulatedMap& world) {
  double sum = 0;
  for (std::size_t i = 1; i < world.frames.size(); ++i)
    sum += (world.frames[i].T_world_rig.translation() - world.frames[i - 1].T_world_rig.translation()).norm();
  return sum;
}

// The rig with a random rotation of camera 1 about its own centre.
camera::Rig turned(const camera::Rig& rig, double sigma_deg, Random& random) {
  solver::RigValues values = solver::RigValues::of(rig);
  geometry::Vector6d turn = geometry::Vector6d::Zero();
  for (int k = 0; k < 3; ++k) turn(k) = sigma_deg * kDegree * random.normal();
  values.T_cam_rig[1] = values.T_cam_rig[1].perturbed(turn);
  return values.applied_to(rig);
}

// Rotations of camera 1 change all depths.
TEST(RefineRig, TheDeviationOfTheScaleIsThatOfItsErrors) {
  const camera::Rig truth = synthetic::ring_rig(2);
  CalibrationOptions options = kExactIntrinsics;
  options.sigma_rotation_deg = 0.05;
  options.sigma_translation_mm = 0.1;
  options.sigma_scale_percent = 0.01;
  constexpr int kCalibrations = 12;
  double sum = 0;
  Random random(1);
  for (int i = 0; i < kCalibrations; ++i) {
    const map::SimulatedMap world = mapped(truth, turned(truth, options.sigma_rotation_deg, random), 8, 0.3);
    const RigRefinement result = refine(world.map, options);
    ASSERT_TRUE(result.done);
    const double error = path_length(world.map) * result.scale_change / true_path_length(world) - 1;
    EXPECT_GT(result.scale_deviation, 1e-4);
    EXPECT_LT(result.scale_deviation, 0.1);
    sum += std::pow(error / result.scale_deviation, 2);
  }
  EXPECT_GT(sum / kCalibrations, 0.35);
  EXPECT_LT(sum / kCalibrations, 2);
}

TEST(MoveSubmap, MovesKeyframesAndLandmarksTogether) {
  const camera::Rig truth = synthetic::ring_rig(2);
  map::SimulatedMap world = mapped(truth, truth, 8, 0.3);
  const KeyframeId k = world.map.newest_keyframe();
  const SE3 wanted = SE3::exp((geometry::Vector6d() << 0.1, 0.2, -0.3, 1, 2, 3).finished());
  map::MapDraft draft = world.draft();
  move_submap(k, wanted, draft);
  EXPECT_LT((draft.map().keyframe(k).T_rig_world.matrix() - wanted.matrix()).norm(), 1e-12);
  for (const LandmarkId l : world.map.landmark_ids()) {
    const auto seen_by = world.map.landmark(l).reference.keyframe;
    const Eigen::Vector3d before = world.map.keyframe(seen_by).T_rig_world * world.map.landmark(l).position;
    const Eigen::Vector3d after = draft.map().keyframe(seen_by).T_rig_world * draft.map().landmark(l).position;
    EXPECT_LT((after - before).norm(), 1e-9);
  }
}

}  // namespace
}  // namespace bslam::calibration::refinement
