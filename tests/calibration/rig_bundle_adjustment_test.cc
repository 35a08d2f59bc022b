#include "calibration/rig_bundle_adjustment.h"

#include <gtest/gtest.h>

#include "calibration/deviation.h"
#include "solver/scene.h"

namespace bslam::calibration {
namespace {

namespace scene = solver::scene;
using camera::Rig;
using geometry::Matrix6d;
using geometry::SE3;
using geometry::Vector2d;
using geometry::Vector3d;
using geometry::Vector6d;
using scene::BundleSpec;
using scene::Models;

constexpr double kDegree = std::numbers::pi / 180;

// The rig with a left perturbation of T_cam_rig of one camera.
Rig with_error(const Rig& rig, std::size_t camera, const Vector6d& error) {
  std::vector<camera::RigCamera> cameras;
  for (std::size_t i = 0; i < rig.size(); ++i) {
    const SE3 T_cam_rig = i == camera ? rig.cam_from_rig(i).perturbed(error) : rig.cam_from_rig(i);
    cameras.push_back({rig.camera(i), rig.body_from_cam(0) * T_cam_rig.inverse()});
  }
  return Rig(std::move(cameras));
}

// Error of an estimate, as a left perturbation.
Vector6d error_of(const RigAdjustment& estimate, std::size_t camera, const Rig& truth) {
  return solver::extrinsic_change(estimate.values.T_cam_rig[camera], truth.cam_from_rig(camera));
}

// Points that are visible from all poses, with 0.5 px of noise. The problem is initialised with the truth.
std::unique_ptr<scene::BundleScene> seen_from(const std::vector<SE3>& T_rig_world, std::size_t cameras, int points,
                                              double outlier_ratio, Random& random) {
  auto out = std::make_unique<scene::BundleScene>(
      scene::BundleScene{scene::make_rig(cameras, Models::kPinhole), {}, T_rig_world, {}});
  out->problem.rig = &out->rig;
  out->problem.T_rig_world = T_rig_world;
  for (std::size_t k = 0; k < T_rig_world.size(); ++k) out->problem.pose_free.push_back(k > 0);
  for (int p = 0; p < points; ++p) {
    const auto from = random.below(static_cast<std::uint32_t>(T_rig_world.size()));
    out->points.push_back(scene::random_visible_point(out->rig, T_rig_world[from], random, 8));
    for (std::size_t k = 0; k < T_rig_world.size(); ++k) {
      for (std::size_t i = 0; i < cameras; ++i) {
        auto pixel = scene::see(out->rig, i, T_rig_world[k], out->points.back());
        if (!pixel) continue;
        *pixel += (random.uniform() < outlier_ratio ? 10.0 : 0.5) * scene::random_noise(random);
        out->problem.observations.push_back({static_cast<int>(k), p, CameraIndex(i), pixel->cast<float>(), 0.5f});
      }
    }
  }
  out->problem.points = out->points;
  return out;
}

// A curve with a radius of 1.5 m, 2.7 m long with a rotation of 100 degrees; cameras overlap (two) or look in all
// directions without overlap (four).
std::unique_ptr<scene::BundleScene> walk(std::size_t cameras, std::uint64_t seed, double outlier_ratio = 0,
                                         int points = 300) {
  Random random(seed, "rig walk");
  std::vector<SE3> T_rig_world;
  for (int k = 0; k < 16; ++k) {
    const double yaw = 0.12 * k;
    const geometry::Quaterniond R =
        Eigen::AngleAxisd(yaw, Vector3d::UnitY()) *
        geometry::Quaterniond(Eigen::AngleAxisd(0.1 * std::sin(k), Vector3d(1, 0, 0.5).normalized()));
    T_rig_world.push_back(
        SE3(R, Vector3d(1.5 * (1 - std::cos(yaw)), 0.05 * std::cos(k), 1.5 * std::sin(yaw))).inverse());
  }
  return seen_from(T_rig_world, cameras, points, outlier_ratio, random);
}

// Poses on a line without any rotation, one metre from first to last.
std::unique_ptr<scene::BundleScene> straight_line(std::size_t cameras, std::uint64_t seed) {
  Random random(seed, "rig line");
  std::vector<SE3> T_rig_world;
  for (int k = 0; k < 8; ++k)
    T_rig_world.emplace_back(geometry::Quaterniond::Identity(), Vector3d(-0.1 * k, -0.02 * k, -0.1 * k));
  return seen_from(T_rig_world, cameras, 300, 0, random);
}

TEST(AdjustRig, EstimatesTheErrorOfOneCamera) {
  for (const std::size_t cameras : {2u, 4u}) {  // overlapping, without overlap
    for (const double outlier_ratio : {0.0, 0.08}) {
      const auto scene = walk(cameras, 7, outlier_ratio);
      Random random(11, "error");
      const std::size_t wrong = cameras - 1;
      const Rig calibrated = with_error(scene->rig, wrong, scene::random_twist(random, kDegree, 0.01));
      scene->problem.rig = &calibrated;
      const RigAdjustment result = adjust_rig(scene->problem);
      ASSERT_TRUE(result.done);
      ASSERT_EQ(result.cameras.size(), cameras);
      for (std::size_t c = 1; c < cameras; ++c) {
        const Vector6d error = error_of(result, c, scene->rig);
        EXPECT_LT(error.head<3>().norm(), 0.1 * kDegree) << cameras << " cameras, camera " << c;
        EXPECT_TRUE(result.cameras[c].observed[0] && result.cameras[c].observed[1] && result.cameras[c].observed[2]);
      }
      EXPECT_NEAR(result.cameras[wrong].change.head<3>().norm(), kDegree, 0.1 * kDegree);
      EXPECT_NEAR(result.variance_factor, 1.0, 0.15);
    }
  }
}

// Cameras with rolling shutters, one of which is late, seen from a rig that walks and turns; the calibration tells
// neither.
TEST(AdjustRig, EstimatesTheTimesAtWhichRowsAreExposed) {
  constexpr double kShift = 0.006, kReadout = 0.015;
  const auto scene = walk(2, 3);
  Random random(4, "timing");
  std::vector<SE3>& poses = scene->problem.T_rig_world;
  scene->problem.observations.clear();
  for (std::size_t k = 0; k < poses.size(); ++k) scene->problem.twist.push_back(scene::random_twist(random, 0.8, 1.0));
  for (int p = 0; p < static_cast<int>(scene->points.size()); ++p) {
    for (std::size_t k = 0; k < poses.size(); ++k) {
      for (std::size_t i = 0; i < 2; ++i) {
        const camera::Shutter shutter(scene->rig.camera(i), {i == 1 ? kShift : 0.0, kReadout},
                                      scene->rig.cam_from_rig(i), scene->problem.twist[k]);
        const auto pixel =
            camera::project(scene->rig.camera(i), shutter,
                            scene->rig.cam_from_rig(i) * (poses[k] * scene->points[static_cast<std::size_t>(p)]));
        if (!pixel || !scene->rig.camera(i).contains(*pixel)) continue;
        const Vector2d seen = *pixel + 0.5 * scene::random_noise(random);
        scene->problem.observations.push_back({static_cast<int>(k), p, CameraIndex(i), seen.cast<float>(), 0.5f});
      }
    }
  }
  RigAdjustmentOptions options;
  options.timing = {{{}, 0.0, 0.01}, {{}, 0.01, 0.01}};
  const RigAdjustment result = adjust_rig(scene->problem, options);
  ASSERT_TRUE(result.done);
  EXPECT_NEAR(result.variance_factor, 1.0, 0.15);
  EXPECT_EQ(result.values.timing[0].shift_s, 0.0);
  EXPECT_EQ(result.cameras[0].timing_sigma.shift_s, 0.0);
  for (std::size_t i = 0; i < 2; ++i) {
    const CameraEstimate& camera = result.cameras[i];
    EXPECT_NEAR(result.values.timing[i].readout_s, kReadout, 4 * camera.timing_sigma.readout_s);
    EXPECT_LT(camera.timing_sigma.readout_s, 2e-4);
    EXPECT_DOUBLE_EQ(camera.timing_change.readout_s, result.values.timing[i].readout_s);
  }
  EXPECT_NEAR(result.values.timing[1].shift_s, kShift, 4 * result.cameras[1].timing_sigma.shift_s);
  EXPECT_LT(result.cameras[1].timing_sigma.shift_s, 2e-4);
  const Rig applied = result.values.applied_to(scene->rig);
  EXPECT_NEAR(to_seconds(applied.camera(std::size_t{1}).time_offset_ns), result.values.timing[1].shift_s, 1e-9);
  EXPECT_EQ(applied.camera(std::size_t{1}).readout_s, result.values.timing[1].readout_s);
}

// The rig with other intrinsics: focal lengths and principal points that are wrong by some pixels.
Rig with_wrong_intrinsics(const Rig& rig, Random& random) {
  solver::RigValues values = solver::RigValues::of(rig);
  for (camera::CameraModel& model : values.models) {
    camera::ModelParameters p = camera::parameters(model);
    p.head<2>() *= 1 + 0.005 * random.normal();
    p.segment<2>(2) += 2.0 * Vector2d(random.normal(), random.normal());
    model = camera::with_parameters(model, p);
  }
  return values.applied_to(rig);
}

std::vector<camera::ModelParameters> usual_sigmas(const Rig& rig) {
  std::vector<camera::ModelParameters> out;
  for (std::size_t c = 0; c < rig.size(); ++c) out.push_back(camera::typical_sigmas(rig.camera(c).model, 0.01, 5.0));
  return out;
}

TEST(AdjustRig, FindsIntrinsicsAndKeepsTheScaleOfTheBaselines) {
  for (const std::size_t cameras : {2u, 4u}) {
    const auto scene = walk(cameras, 5, 0.05, 600);
    Random random(4, "intrinsics");
    const Rig calibrated = with_wrong_intrinsics(scene->rig, random);
    scene->problem.rig = &calibrated;
    RigAdjustmentOptions options;
    options.sigma_intrinsics = usual_sigmas(calibrated);
    options.sigma_scale = 1e-3;
    const RigAdjustment result = adjust_rig(scene->problem, options);
    ASSERT_TRUE(result.done);
    EXPECT_NEAR(result.variance_factor, 1.0, 0.15);
    EXPECT_GT(result.excess_error, 0.1);
    for (std::size_t c = 0; c < cameras; ++c) {
      const camera::ModelParameters error =
          camera::parameters(result.values.models[c]) - camera::parameters(scene->rig.camera(c).model);
      EXPECT_LT((error.cwiseQuotient(result.cameras[c].intrinsics_sigma)).cwiseAbs().maxCoeff(), 4.0) << "camera " << c;
      EXPECT_TRUE(result.cameras[c].intrinsics_observed[0]) << "camera " << c;
      EXPECT_LT(std::abs(error(0)), 0.002 * camera::parameters(scene->rig.camera(c).model)(0)) << "camera " << c;
    }
    const auto weights = solver::baseline_weights({.T_cam_rig = solver::RigValues::of(calibrated).T_cam_rig,
                                                   .sigma_translation = options.sigma_translation,
                                                   .sigma_depth = options.sigma_depth});
    EXPECT_NEAR(solver::baseline_scale(result.values.T_cam_rig, weights), 1.0, 1e-9);
  }
}

// The others keep their baselines: the displacement of one camera is no change of the scale.
TEST(AdjustRig, ADisplacedCameraDoesNotChangeTheScale) {
  const auto scene = walk(4, 6, 0.05, 600);
  const Vector6d error = (Vector6d() << 0, 0, 0, 0.03, 0.04, 0.05).finished();
  const Rig calibrated = with_error(scene->rig, 3, error);
  scene->problem.rig = &calibrated;
  RigAdjustmentOptions options;
  options.sigma_translation = 0.005;
  options.sigma_scale = 5e-3;
  const RigAdjustment result = adjust_rig(scene->problem, options);
  ASSERT_TRUE(result.done);
  for (const std::size_t c : {1u, 2u, 3u})
    EXPECT_LT(error_of(result, c, scene->rig).tail<3>().norm(), 0.004) << "camera " << c;
}

TEST(Deviation, OfADisplacementOnlyThePartThatIsNotObservedCounts) {
  const Eigen::Matrix3d turn = geometry::so3_exp({0.3, -0.5, 0.8}).toRotationMatrix();
  const Vector3d sigmas(1, 2, 4), change(3, 4, 12);
  const Eigen::Matrix3d prior = sigmas.cwiseAbs2().asDiagonal();
  const auto length = [&](const Vector3d& ratios) {
    const Eigen::Matrix3d covariance = sigmas.cwiseProduct(ratios).cwiseAbs2().asDiagonal();
    return unobserved_length(turn * change, turn * covariance * turn.transpose(), turn * prior * turn.transpose(), 0.5);
  };
  EXPECT_NEAR(length({0.1, 0.4, 0.9}), 12, 1e-9);
  EXPECT_NEAR(length({0.1, 0.9, 0.4}), 4, 1e-9);
  EXPECT_NEAR(length({0.6, 0.9, 0.4}), 5, 1e-9);
  EXPECT_NEAR(length({1, 1, 1}), 13, 1e-9);
  EXPECT_NEAR(length({0.1, 0.2, 0.3}), 0, 1e-9);
}

TEST(AdjustRig, CamerasAreDisplacedAtTheScaleOfTheOthers) {
  const auto at = [](double x, double y) { return SE3(Eigen::Quaterniond::Identity(), Vector3d(x, y, 0)); };
  const solver::ExtrinsicPrior prior{
      .T_cam_rig = {SE3(), at(0.1, 0), at(0, 0.2), at(-0.15, 0)}, .sigma_rotation = 0.01, .sigma_translation = 0.005};
  const auto displaced = [&](double scale, double of_3, double of_2) {
    return solver::displaced_cameras(
        std::vector{SE3(), at(0.1 * scale, 0), at(0, scale * (0.2 + of_2)), at(scale * -0.15, scale * of_3)}, prior);
  };
  EXPECT_EQ(displaced(1.0, 0.015, 0), (std::vector<std::uint8_t>{0, 0, 0, 0}));
  EXPECT_EQ(displaced(1.2, 0.03, 0), (std::vector<std::uint8_t>{0, 0, 0, 1}));
  EXPECT_EQ(displaced(1.0, 0.03, 0.1), (std::vector<std::uint8_t>{0, 0, 0, 0}));  // no majority for any scale
  const solver::ExtrinsicPrior of_pair{.T_cam_rig = {SE3(), at(0.1, 0)}, .sigma_translation = 0.005};
  EXPECT_EQ(solver::displaced_cameras(std::vector{SE3(), at(0.2, 0)}, of_pair), (std::vector<std::uint8_t>{0, 0}));
}

// A baseline whose direction is corrected keeps its length.
TEST(AdjustRig, TheScaleOfTheBaselinesIsThatOfTheirLengths) {
  const auto at = [](double x, double y, double z) {
    return std::vector{SE3(), SE3(Eigen::Quaterniond::Identity(), Vector3d(x, y, z))};
  };
  const auto weights = solver::baseline_weights({.T_cam_rig = at(0.1, 0, 0), .sigma_translation = 0.005});
  EXPECT_NEAR(solver::baseline_scale(at(0.08, 0.06, 0), weights), 1.0, 1e-12);
  EXPECT_NEAR(solver::baseline_scale(at(0, 0, -0.2), weights), 2.0, 1e-12);
  const auto centre = solver::baseline_weights({.T_cam_rig = at(0, 0, 0), .sigma_translation = 0.005});
  EXPECT_EQ(solver::baseline_scale(at(0, 0, 0.2), centre), 1.0);
}

// The distance of a camera along an optical axis is less certain than that of one beside, so that it counts less.
TEST(AdjustRig, TheScaleOfTheBaselinesWeighsThemByTheirDeviation) {
  const auto at = [](double x, double z) { return SE3(Eigen::Quaterniond::Identity(), Vector3d(x, 0, z)); };
  solver::ExtrinsicPrior prior{
      .T_cam_rig = {SE3(), at(0.1, 0), at(0, 0.1)}, .sigma_translation = 0.003, .sigma_depth = 0.004};
  // Variances along the baselines in mm^2: 9, and with both axes in the direction of the second 9 + 2 * 16 = 41.
  const auto scale = [&] {
    return solver::baseline_scale(std::vector{SE3(), at(0.1, 0), at(0, 0.2)}, solver::baseline_weights(prior));
  };
  EXPECT_NEAR(scale(), std::sqrt((1.0 / 9 + 4.0 / 41) / (1.0 / 9 + 1.0 / 41)), 1e-12);
  prior.displaced = {0, 1, 0};
  EXPECT_NEAR(scale(), 2.0, 1e-12);
  prior.displaced = {0, 0, 1};
  EXPECT_NEAR(scale(), 1.0, 1e-12);
  prior.displaced.clear();
  prior.with_baseline = 2;
  EXPECT_NEAR(scale(), 1.0, 1e-12);
}

// With a right calibration nothing that the images do not demand is changed.
TEST(AdjustRig, ARightCalibrationHasNoExcessError) {
  const auto scene = walk(4, 6, 0, 600);
  RigAdjustmentOptions options;
  options.sigma_intrinsics = usual_sigmas(scene->rig);
  options.sigma_scale = 1e-3;
  const RigAdjustment result = adjust_rig(scene->problem, options);
  ASSERT_TRUE(result.done);
  EXPECT_LT(result.excess_error, 0.02);
}

TEST(AdjustRig, ErrorsMatchTheirStandardDeviations) {
  const RigAdjustmentOptions options{.sigma_rotation = 0.5 * kDegree, .sigma_translation = 0.02};
  for (const std::size_t cameras : {2u, 4u}) {
    Vector6d squared = Vector6d::Zero();  // normalised, by degree of freedom
    double distance = 0;                  // normalised, of all six together
    int estimates = 0;
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
      const auto scene = walk(cameras, seed);
      Random random(seed, "calibration");
      Rig calibrated = scene->rig;
      for (std::size_t c = 1; c < cameras; ++c) {
        Vector6d error;  // distributed as the prior
        for (int k = 0; k < 6; ++k)
          error(k) = (k < 3 ? options.sigma_rotation : options.sigma_translation) * random.normal();
        calibrated = with_error(calibrated, c, error);
      }
      scene->problem.rig = &calibrated;
      const RigAdjustment result = adjust_rig(scene->problem, options);
      ASSERT_TRUE(result.done) << "seed " << seed;
      for (std::size_t c = 1; c < cameras; ++c) {
        const Vector6d error = error_of(result, c, scene->rig);
        const Matrix6d& covariance = result.cameras[c].covariance;
        squared += error.cwiseAbs2().cwiseQuotient(covariance.diagonal());
        distance += error.dot(covariance.ldlt().solve(error));
        ++estimates;
      }
    }
    EXPECT_GT(distance / estimates, 0.6 * 6) << cameras << " cameras";
    EXPECT_LT(distance / estimates, 1.5 * 6) << cameras << " cameras";
    for (int k = 0; k < 6; ++k) {
      EXPECT_GT(squared(k) / estimates, 0.35) << cameras << " cameras, " << k;
      EXPECT_LT(squared(k) / estimates, 2.2) << cameras << " cameras, " << k;
    }
  }
}

TEST(AdjustRig, WithoutRotationTheTranslationOfACameraWithoutOverlapIsNotObserved) {
  const auto scene = straight_line(4, 5);
  // No point is observed by two cameras.
  std::vector<CameraIndex> owner(scene->points.size());
  std::erase_if(scene->problem.observations, [&](const solver::ReprojectionProblem::Observation& o) {
    CameraIndex& first = owner[static_cast<std::size_t>(o.point)];
    if (!first.valid()) first = o.camera;
    return o.camera != first;
  });
  const RigAdjustmentOptions options;
  const RigAdjustment result = adjust_rig(scene->problem, options);
  ASSERT_TRUE(result.done);
  for (std::size_t c = 1; c < 4; ++c) {
    for (std::size_t k = 3; k < 6; ++k) {
      const auto at = static_cast<Eigen::Index>(k);
      EXPECT_FALSE(result.cameras[c].observed[k]) << "camera " << c;
      EXPECT_NEAR(std::sqrt(result.cameras[c].covariance(at, at)), options.sigma_translation,
                  0.05 * options.sigma_translation);
    }
    // The common direction of motion determines the two rotations perpendicular to it, but not the rotation around it.
    const Vector3d travel =
        (scene->rig.cam_from_rig(c).rotation() * scene->T_rig_world.back().translation()).normalized();
    const Vector3d across = travel.unitOrthogonal();
    const Eigen::Matrix3d rotation = result.cameras[c].covariance.topLeftCorner<3, 3>();
    EXPECT_LT(std::sqrt(across.dot(rotation * across)), 0.25 * options.sigma_rotation) << "camera " << c;
    EXPECT_GT(std::sqrt(travel.dot(rotation * travel)), 0.9 * options.sigma_rotation) << "camera " << c;
  }
}

TEST(AdjustRig, LengthOfTheOnlyBaselineIsNotObserved) {
  const auto scene = straight_line(2, 6);
  const RigAdjustmentOptions options;
  const RigAdjustment result = adjust_rig(scene->problem, options);
  ASSERT_TRUE(result.done);
  const Vector3d along = scene->rig.cam_from_rig(1).translation().normalized();
  const Eigen::Matrix3d covariance = result.cameras[1].covariance.bottomRightCorner<3, 3>();
  EXPECT_NEAR(std::sqrt(along.dot(covariance * along)), options.sigma_translation, 0.05 * options.sigma_translation);
  EXPECT_FALSE(result.cameras[1].observed[3]);  // the baseline runs along x
  for (const std::size_t k : {0u, 1u, 2u, 4u}) EXPECT_TRUE(result.cameras[1].observed[k]) << k;
}

TEST(AdjustRig, CameraWithoutObservationsKeepsItsCalibration) {
  const auto scene = walk(4, 8);
  std::erase_if(scene->problem.observations,
                [](const solver::ReprojectionProblem::Observation& o) { return o.camera == CameraIndex(2); });
  const RigAdjustmentOptions options;
  const RigAdjustment result = adjust_rig(scene->problem, options);
  ASSERT_TRUE(result.done);
  const CameraEstimate& silent = result.cameras[2];
  EXPECT_EQ(silent.observations, 0);
  EXPECT_LT(silent.change.norm(), 1e-12);
  EXPECT_EQ(silent.observed, (std::array<bool, 6>{}));
  EXPECT_NEAR(std::sqrt(silent.covariance(0, 0)), options.sigma_rotation, 1e-9);
  EXPECT_NEAR(std::sqrt(silent.covariance(5, 5)), options.sigma_translation, 1e-9);
  EXPECT_GT(result.cameras[1].observations, 100);
}

// Different capture times have the same effect as wrong extrinsics unless the motion between them is known.
TEST(AdjustRig, DistinguishesMotionBetweenCamerasFromExtrinsics) {
  const auto scene = walk(4, 9);
  const std::size_t cameras = 4, late = 3;
  const SE3 moved = SE3::exp((Vector6d() << 0, 0.02, 0, 0.01, 0, 0.03).finished());
  scene->problem.motion.assign(scene->T_rig_world.size() * cameras, SE3());
  for (std::size_t k = 0; k < scene->T_rig_world.size(); ++k) scene->problem.motion[k * cameras + late] = moved;
  for (solver::ReprojectionProblem::Observation& o : scene->problem.observations) {
    if (o.camera.index() != late) continue;
    const Vector3d before =
        scene->T_rig_world[static_cast<std::size_t>(o.pose)] * scene->points[static_cast<std::size_t>(o.point)];
    const Vector2d shift = *scene->rig.camera(late).project(scene->rig.cam_from_rig(late) * (moved * before)) -
                           *scene->rig.camera(late).project(scene->rig.cam_from_rig(late) * before);
    o.pixel += shift.cast<float>();
  }
  solver::ReprojectionProblem unaware = scene->problem;
  unaware.motion.clear();
  const RigAdjustment with_motion = adjust_rig(scene->problem), without_motion = adjust_rig(unaware);
  ASSERT_TRUE(with_motion.done && without_motion.done);
  EXPECT_LT(with_motion.cameras[late].change.head<3>().norm(), 0.1 * kDegree);
  EXPECT_NEAR(without_motion.cameras[late].change.head<3>().norm(), 0.02, 0.1 * kDegree);
}

TEST(AdjustRig, DoesNotChangeTheProblemOnFailure) {
  const auto scene = walk(2, 10);
  const solver::ReprojectionProblem before = scene->problem;
  std::stop_source stop;
  stop.request_stop();
  EXPECT_FALSE(adjust_rig(scene->problem, {}, {}, stop.get_token()).done);
  const Rig alone = scene->rig.subset(std::array{0});
  solver::ReprojectionProblem single = before;
  single.rig = &alone;
  std::erase_if(single.observations,
                [](const solver::ReprojectionProblem::Observation& o) { return o.camera != CameraIndex(0); });
  const RigAdjustment of_one = adjust_rig(single);
  EXPECT_FALSE(of_one.done);
  EXPECT_EQ(of_one.cameras.size(), 1u);
  solver::ReprojectionProblem empty = before;
  empty.observations.clear();
  EXPECT_FALSE(adjust_rig(empty).done);
  EXPECT_EQ(scene->problem.points, before.points);
  EXPECT_EQ(single.points, before.points);
}

TEST(AdjustRig, IsDeterministicAndKeepsFixedPoses) {
  const auto scene = walk(3, 12, 0.05);
  const SE3 fixed = scene->problem.T_rig_world.front();
  solver::ReprojectionProblem a = scene->problem, b = scene->problem;
  const RigAdjustment first = adjust_rig(a), second = adjust_rig(b);
  ASSERT_TRUE(first.done);
  EXPECT_EQ(first.final_cost, second.final_cost);
  EXPECT_EQ(a.points, b.points);
  for (std::size_t c = 0; c < 3; ++c) {
    EXPECT_EQ(first.cameras[c].change, second.cameras[c].change);
    EXPECT_EQ(first.cameras[c].covariance, second.cameras[c].covariance);
  }
  EXPECT_EQ(a.T_rig_world.front().matrix(), fixed.matrix());
}

}  // namespace
}  // namespace bslam::calibration
