// Covariances of poses against the errors of maps adjusted to simulated features, whose noise is independent.
#include "adjustment/pose_uncertainty.h"

#include <gtest/gtest.h>

#include "adjustment/map_adjustment.h"
#include "mapping/simulated_map.h"

namespace bslam::adjustment {
namespace {

constexpr feature::FeatureModel kPoseFeatures{.sigma_px = 0.7, .pyramid = {}};
constexpr AdjustmentOptions kIndependent{.relative_decrease = 1e-6, .correlated_observations = 1};
constexpr std::uint64_t kSeeds = 300;

map::SimulatedMap simulated(std::uint64_t seed, int keyframes) {
  synthetic::FeatureSimulatorOptions options;
  options.scene_seed = options.noise_seed = seed;
  options.landmarks = 1500;
  options.max_keypoints = 120;
  options.sigma_px = kPoseFeatures.sigma_px;
  map::SimulatedMap out(synthetic::FeatureSimulator(synthetic::ring_rig(2), synthetic::make_orbit({}), options));
  for (int i = 0; i < keyframes; ++i) out.add_keyframe(FrameId(i), 0.3 * i);
  return out;
}

// Keyframe `newest` and the `free` - 1 before it are free, the `fixed` before those are fixed.
Selection window(const map::BundledMap& map, int newest, int free, int fixed) {
  Selection out;
  const int first_free = std::max(1, newest - free + 1);
  for (int k = std::max(0, first_free - fixed); k < first_free; ++k) out.fixed_keyframes.emplace_back(k);
  for (int k = first_free; k <= newest; ++k) out.free_keyframes.emplace_back(k);
  out.landmarks = map.landmark_ids();
  out.with_uncertainty = {KeyframeId(newest)};
  return out;
}

void adjust(const Selection& selection, const AdjustmentOptions& options, map::BundledMap& map) {
  map::MapDraft draft(std::make_shared<const map::BundledMap>(map));
  ASSERT_TRUE(adjust_map(selection, options, kPoseFeatures, draft));
  map = std::move(draft).finish().result;
}

// Normalised estimation error squared per degree of freedom: 1 on average if the uncertainty is right.
double nees(const map::SimulatedMap& world, KeyframeId k) {
  const map::BundledKeyframe& keyframe = world.map.keyframe(k);
  const geometry::Vector6d error = (world.true_pose(k) * keyframe.T_rig_world.inverse()).log();
  return error.dot(keyframe.uncertainty.covariance().ldlt().solve(error)) / 6;
}

// Adds an error with the first six of these standard deviations to the extrinsics of camera 1.
void displace_camera_1(const Eigen::VectorXd& deviations, Random& random, solver::RigValues& values) {
  geometry::Vector6d error;
  for (int i = 0; i < 6; ++i) error(i) = deviations(i) * random.normal();
  values.T_cam_rig[1] = values.T_cam_rig[1].perturbed(error);
}

TEST(PoseUncertainties, MatchTheErrorsOfOneAdjustment) {
  double sum = 0;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    map::SimulatedMap world = simulated(seed, 4);
    Selection selection = window(world.map, 3, 3, 1);
    selection.with_uncertainty = selection.free_keyframes;
    adjust(selection, kIndependent, world.map);
    for (const KeyframeId k : selection.free_keyframes) sum += nees(world, k) / 3;
    EXPECT_EQ(world.map.keyframe(KeyframeId(0)).uncertainty.noise, geometry::Matrix6d::Zero());
  }
  EXPECT_GT(sum / kSeeds, 0.75);
  EXPECT_LT(sum / kSeeds, 1.3);
}

// Each window has fixed keyframes with errors of their own.
TEST(PoseUncertainties, MatchTheErrorsOfAChainOfWindows) {
  constexpr int kKeyframes = 9;
  double sum = 0;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    map::SimulatedMap world = simulated(seed, kKeyframes);
    for (int k = 1; k < kKeyframes; ++k) adjust(window(world.map, k, 3, 3), kIndependent, world.map);
    sum += nees(world, KeyframeId(kKeyframes - 1));
  }
  EXPECT_GT(sum / kSeeds, 0.6);
  EXPECT_LT(sum / kSeeds, 1.5);
}

// Keyframes are adjusted with a wrong calibration. Its error is the same in all windows, so that its effect grows with
// the distance from the root.
TEST(PoseUncertainties, IncludeTheErrorOfTheCalibration) {
  constexpr int kKeyframes = 9;
  double given_rig = 0, sum = 0;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    map::SimulatedMap world = simulated(seed, kKeyframes);
    solver::RigValues values = solver::RigValues::of(world.map.rig());
    const auto intrinsics = camera::parameters(values.models[0]).size();
    Eigen::VectorXd deviations = Eigen::VectorXd::Zero(6 + 2 * intrinsics);
    deviations.head<6>() << 1e-3, 1e-3, 1e-3, 2e-3, 2e-3, 2e-3;
    Random random(seed, "calibration");
    displace_camera_1(deviations, random, values);
    world.map.set_rig(std::make_shared<const camera::Rig>(values.applied_to(world.map.rig())),
                      std::make_shared<const Eigen::MatrixXd>(deviations.asDiagonal()));
    for (int k = 1; k < kKeyframes; ++k) adjust(window(world.map, k, 3, 3), kIndependent, world.map);
    sum += nees(world, KeyframeId(kKeyframes - 1));
    world.map.set_uncertainty(KeyframeId(kKeyframes - 1),
                              {world.map.keyframe(KeyframeId(kKeyframes - 1)).uncertainty.noise});
    given_rig += nees(world, KeyframeId(kKeyframes - 1));
  }
  EXPECT_GT(given_rig / kSeeds, 5.0);
  EXPECT_GT(sum / kSeeds, 0.6);
  EXPECT_LT(sum / kSeeds, 1.5);
}

// The error of a calibration that no images have tested is estimated from its prior and the images of the window.
TEST(PoseUncertainties, IncludeTheErrorOfACalibrationThatIsNotTestedYet) {
  constexpr int kKeyframes = 5;
  double sum = 0, exact = 0;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    map::SimulatedMap world = simulated(seed, kKeyframes);
    solver::RigValues values = solver::RigValues::of(world.map.rig());
    const auto intrinsics = camera::parameters(values.models[0]).size();
    Eigen::VectorXd deviations = Eigen::VectorXd::Constant(6 + 2 * intrinsics, 1e-6);
    deviations.head<6>() << 1e-3, 1e-3, 1e-3, 2e-3, 2e-3, 2e-3;
    Random random(seed, "calibration");
    displace_camera_1(deviations, random, values);
    for (std::size_t c = 0; c < 2; ++c) {  // fx, fy, cx, cy in pixels
      const auto first = 6 + static_cast<Eigen::Index>(c) * intrinsics;
      deviations.segment<4>(first).setConstant(0.5);
      camera::ModelParameters changed = camera::parameters(values.models[c]);
      for (int i = 0; i < 4; ++i) changed(i) += 0.5 * random.normal();
      values.models[c] = camera::with_parameters(values.models[c], changed);
    }
    world.map.set_rig(std::make_shared<const camera::Rig>(values.applied_to(world.map.rig())), nullptr);
    Selection selection = window(world.map, kKeyframes - 1, kKeyframes - 1, 1);
    selection.rig_prior = std::make_shared<const Eigen::MatrixXd>(deviations.cwiseAbs2().cwiseInverse().asDiagonal());
    adjust(selection, kIndependent, world.map);
    const KeyframeId newest(kKeyframes - 1);
    sum += nees(world, newest);
    selection.rig_prior.reset();
    adjust(selection, kIndependent, world.map);
    EXPECT_EQ(world.map.keyframe(newest).uncertainty.calibration.cols(), 0);
    exact += nees(world, newest);
  }
  EXPECT_GT(exact / kSeeds, 2.0);
  EXPECT_GT(sum / kSeeds, 0.6);
  EXPECT_LT(sum / kSeeds, 1.5);
}

TEST(PoseUncertainties, AddTheTransportedCovarianceOfTheAnchor) {
  map::SimulatedMap world = simulated(1, 6);
  map::SimulatedMap displaced = simulated(1, 6);
  geometry::Vector6d deviations;
  deviations << 1e-3, 2e-3, 3e-3, 0.01, 0.02, 0.03;
  const geometry::Matrix6d of_fixed = deviations.cwiseAbs2().asDiagonal();
  displaced.map.set_uncertainty(KeyframeId(2), {of_fixed});
  for (map::SimulatedMap* map : {&world, &displaced}) adjust(window(map->map, 5, 3, 1), kIndependent, map->map);
  const KeyframeId newest(5);
  const geometry::SE3 T_newest_fixed =
      world.map.keyframe(newest).T_rig_world * world.map.keyframe(KeyframeId(2)).T_rig_world.inverse();
  const geometry::Matrix6d A = T_newest_fixed.adjoint();
  const geometry::Matrix6d added =
      displaced.map.keyframe(newest).uncertainty.noise - world.map.keyframe(newest).uncertainty.noise;
  EXPECT_LT((added - A * of_fixed * A.transpose()).norm(), 1e-12);
}

TEST(PoseUncertainties, GrowWithTheNumberOfCorrelatedObservations) {
  map::SimulatedMap one = simulated(2, 4), ten = simulated(2, 4);
  adjust(window(one.map, 3, 3, 1), kIndependent, one.map);
  AdjustmentOptions options = kIndependent;
  options.correlated_observations = 10;
  adjust(window(ten.map, 3, 3, 1), options, ten.map);
  const geometry::Matrix6d& covariance = one.map.keyframe(KeyframeId(3)).uncertainty.noise;
  EXPECT_GT(covariance.norm(), 0.0);
  EXPECT_LT((ten.map.keyframe(KeyframeId(3)).uncertainty.noise - 10 * covariance).norm(), 1e-9 * covariance.norm());
  EXPECT_EQ(one.map.keyframe(KeyframeId(3)).T_rig_world.translation(),
            ten.map.keyframe(KeyframeId(3)).T_rig_world.translation());
}

}  // namespace
}  // namespace bslam::adjustment
