// Metric scale of maps from three cameras without overlap, compared with the ground truth of the simulation.
#include "mapping/scale_observation.h"

#include <gtest/gtest.h>

#include "mapping/local_adjustment.h"
#include "mapping/map_keyframe.h"
#include "mapping/simulated_map.h"

namespace bslam::mapping {
namespace {

using map::SimulatedMap;
const FeatureModel kDefaultFeatures;

// One camera facing forward and two at 120 degrees to either side.
camera::Rig three_sides() {
  const std::vector<int> sides = {0, 2, 3};
  return synthetic::ring_rig(4).subset(sides);
}

synthetic::FeatureSimulatorOptions room(std::uint64_t seed) {
  synthetic::FeatureSimulatorOptions options;
  options.scene_seed = options.noise_seed = seed;
  options.landmarks = 4000;
  options.max_keypoints = 300;
  options.outlier_share = 0.02;
  return options;
}

// Here the rotations of the cameras are exact and the errors of a landmark in successive images independent.
MappingOptions independent_noise() {
  MappingOptions options;
  options.scale.sigma_rotation_deg = 0.0;
  options.scale.correlated_observations = 1.0;
  return options;
}

// Keyframes at their true poses, 0.25 s apart, in a map with unobservable scale whose length unit is 1 / `factor`
// metres.
SimulatedMap simulated_map(const synthetic::Trajectory& trajectory, const camera::Rig& rig, int keyframes,
                           double factor, std::uint64_t seed) {
  SimulatedMap world(synthetic::FeatureSimulator(rig, trajectory, room(seed)));
  for (int i = 0; i < keyframes; ++i) world.add_keyframe(FrameId(i), 0.25 * i);
  world.map.set_scale(map::Scale::kUnobservable);
  world.map.scale_submap(KeyframeId(0), factor);
  return world;
}

synthetic::Trajectory orbit(std::uint64_t seed) { return synthetic::make_orbit({.seed = seed}); }

// Forward at 0.4 m/s without rotation; too short for a landmark to pass from one camera to another.
synthetic::Trajectory straight_line() {
  std::vector<synthetic::ControlPose> control;
  for (int i = 0; i < 8; ++i) control.push_back({{0.4 * i - 1.5, 0.3, 1.5}, 0.0, 0.0, 0.0});
  return synthetic::Trajectory(std::move(control), 1.0);
}

// Ratio of lengths in a submap to true lengths.
double length_ratio(const SimulatedMap& world, const map::BundledMap& map, KeyframeId root = KeyframeId(0)) {
  double found = 0, truth = 0;
  for (const KeyframeId k : map.keyframes_of_submap(root)) {
    found += map::distance_m(map.keyframe(k).T_rig_world, map.keyframe(root).T_rig_world);
    truth += map::distance_m(world.true_pose(k), world.true_pose(root));
  }
  return found / truth;
}

TEST(ObserveScale, DeviationAgreesWithTheErrors) {
  double squared_z = 0;
  constexpr int kSeeds = 12;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const SimulatedMap world = simulated_map(orbit(seed), three_sides(), 7, 1.0, seed);
    map::MapDraft draft = world.draft();
    // The adjustment moves the map from the truth to the optimum for the noisy pixels.
    map_keyframe(KeyframeId(6), independent_noise(), kDefaultFeatures, draft);
    const ScaleReport report = observe_scale(KeyframeId(6), independent_noise().scale, kDefaultFeatures, draft);
    ASSERT_TRUE(report.observed);
    const double z = (length_ratio(world, draft.map()) - 1.0) / report.deviation;
    EXPECT_LT(std::abs(z), 4.0) << "seed " << seed << ": " << length_ratio(world, draft.map()) << " +- "
                                << report.deviation;
    squared_z += z * z;
  }
  EXPECT_GT(squared_z / kSeeds, 0.3);
  EXPECT_LT(squared_z / kSeeds, 2.5);
}

TEST(ObserveScale, ConvergesFromThreeTimesTooLargeOrTooSmall) {
  for (const double factor : {1.0 / 3.0, 3.0}) {
    const SimulatedMap world = simulated_map(orbit(1), three_sides(), 8, factor, 1);
    map::MapDraft draft = world.draft();
    map_keyframe(KeyframeId(7), independent_noise(), kDefaultFeatures, draft);
    map::MapDraft measured = draft;
    EXPECT_TRUE(observe_scale(KeyframeId(7), independent_noise().scale, kDefaultFeatures, measured).observed);
    EXPECT_EQ(draft.map().scale(), map::Scale::kUnobservable);  // a single measurement is not enough
    EXPECT_NEAR(length_ratio(world, draft.map()), 1.0, 0.05) << factor;
    map_keyframe(KeyframeId(7), independent_noise(), kDefaultFeatures, draft);
    map_keyframe(KeyframeId(7), independent_noise(), kDefaultFeatures, draft);
    EXPECT_EQ(draft.map().scale(), map::Scale::kMetric) << factor;
    EXPECT_LE(draft.map().scale_deviation(), 0.02);
    EXPECT_NEAR(length_ratio(world, draft.map()), 1.0, 3.5 * draft.map().scale_deviation()) << factor;
    EXPECT_EQ(draft.map().check_invariants(), std::nullopt);
  }
}

TEST(ObserveScale, FollowsMatchedFeaturesUnlessTheMapWasCorrectedSince) {
  constexpr double kSize = 1.4;
  for (const map::Scale scale : {map::Scale::kUnobservable, map::Scale::kMetric}) {
    SimulatedMap world(synthetic::FeatureSimulator(three_sides(), orbit(1), room(1)));
    world.change_frame = [](frame::BundledFrame& frame) { frame.stereo_scale = frame::StereoScale{1 / kSize, 1}; };
    for (int i = 0; i < 4; ++i) world.add_keyframe(FrameId(i), 0.25 * i);
    world.map.set_scale(scale);
    world.map.scale_submap(KeyframeId(0), kSize);
    ASSERT_EQ(world.map.gauge_epoch(), 1);
    map::MapDraft draft = world.draft();
    apply_stereo_scale(KeyframeId(3), draft);
    const double left = scale == map::Scale::kUnobservable ? 1.0 : kSize;
    EXPECT_NEAR(length_ratio(world, draft.map()), left, 1e-9);
    EXPECT_EQ(draft.map().scale(), scale);
    apply_stereo_scale(KeyframeId(3), draft);
    EXPECT_NEAR(length_ratio(world, draft.map()), left, 1e-9) << "once";
    EXPECT_EQ(draft.map().check_invariants(), std::nullopt);
  }
}

// Two submaps with different scales, the older one of which has `keyframes` keyframes.
SimulatedMap with_older_submap(int keyframes) {
  SimulatedMap world = simulated_map(orbit(1), three_sides(), keyframes, 1.4, 1);
  world.begin_submap();
  const KeyframeId root = world.add_keyframe(FrameId(20), 0.25 * 20);
  for (int i = 21; i < 28; ++i) world.add_keyframe(FrameId(i), 0.25 * i);
  world.map.scale_submap(root, 0.8);
  return world;
}

TEST(ObserveScale, BecomesMetricIfTheScalesOfAllSubmapsAreObservable) {
  const SimulatedMap world = with_older_submap(6);
  const KeyframeId newest = world.map.newest_keyframe();
  map::MapDraft draft = world.draft();
  for (int i = 0; i < 3; ++i) map_keyframe(newest, independent_noise(), kDefaultFeatures, draft);
  EXPECT_EQ(draft.map().scale(), map::Scale::kMetric);
  ASSERT_EQ(draft.map().roots().size(), 2u);
  for (const KeyframeId root : draft.map().roots())
    EXPECT_NEAR(length_ratio(world, draft.map(), root), 1.0, 3.5 * draft.map().scale_deviation());
  EXPECT_LE(draft.map().scale_deviation(), 0.1);
  EXPECT_EQ(draft.map().check_invariants(), std::nullopt);
}

TEST(ObserveScale, IsUnobservableIfThatOfAnOlderSubmapIs) {
  const SimulatedMap world = with_older_submap(1);
  const KeyframeId newest = world.map.newest_keyframe();
  map::MapDraft draft = world.draft();
  for (int i = 0; i < 3; ++i) map_keyframe(newest, independent_noise(), kDefaultFeatures, draft);
  EXPECT_EQ(draft.map().scale(), map::Scale::kUnobservable);
  EXPECT_NEAR(length_ratio(world, draft.map(), draft.map().roots().back()), 1.0, 0.05);
  EXPECT_LE(draft.map().scale_deviation(), 0.02);  // that of the newest submap
}

TEST(ObserveScale, IsUnobservableOnAStraightLine) {
  for (const std::uint64_t seed : {1, 2, 3, 4}) {
    const SimulatedMap world = simulated_map(straight_line(), three_sides(), 12, 1.5, seed);
    map::MapDraft draft = world.draft();
    for (int i = 0; i < 2; ++i) {
      map_keyframe(KeyframeId(11), independent_noise(), kDefaultFeatures, draft);
      map::MapDraft measured = draft;
      const ScaleReport report = observe_scale(KeyframeId(11), independent_noise().scale, kDefaultFeatures, measured);
      EXPECT_TRUE(!report.observed || report.deviation > 0.1) << "seed " << seed << ": " << report.deviation;
    }
    EXPECT_EQ(draft.map().scale(), map::Scale::kUnobservable);
  }
}

TEST(ObserveScale, DoesNotChangeMapsOfKnownOrArbitraryScale) {
  SimulatedMap world = simulated_map(orbit(1), three_sides(), 4, 1.5, 1);
  for (const map::Scale scale : {map::Scale::kMetric, map::Scale::kUpToScale}) {
    world.map.set_scale(scale);
    map::MapDraft draft = world.draft();
    EXPECT_FALSE(observe_scale(KeyframeId(3), {}, kDefaultFeatures, draft).observed);
    EXPECT_EQ(draft.map().scale(), scale);
    EXPECT_EQ(draft.map().keyframe(KeyframeId(3)).T_rig_world.translation(),
              world.map.keyframe(KeyframeId(3)).T_rig_world.translation());
  }
}

TEST(ObserveScale, ContradictsAWrongMetricScaleThatWasEstimatedFromMotion) {
  for (const double factor : {1.0, 0.4}) {
    SimulatedMap world = simulated_map(orbit(1), three_sides(), 9, factor, 1);
    world.map.set_scale(map::Scale::kMetric, 0.01);
    map::MapDraft draft = world.draft();
    const ScaleReport report = observe_scale(KeyframeId(8), independent_noise().scale, kDefaultFeatures, draft);
    EXPECT_EQ(report.correction > 1.5, factor < 1.0) << factor;
    EXPECT_EQ(draft.map().scale(), factor < 1.0 ? map::Scale::kUnobservable : map::Scale::kMetric);
    map::MapDraft mapped = world.draft();
    map_keyframe(KeyframeId(8), independent_noise(), kDefaultFeatures,
                 mapped);  // a single estimate does not make it metric
    EXPECT_EQ(mapped.map().scale(), factor < 1.0 ? map::Scale::kUnobservable : map::Scale::kMetric);
    EXPECT_NEAR(length_ratio(world, mapped.map()), 1.0, 0.1) << factor;
  }
}

TEST(ObserveScale, IsUnobservableWithOneCameraOrOneKeyframe) {
  const SimulatedMap one = simulated_map(orbit(1), synthetic::ring_rig(1), 5, 1.5, 1);
  map::MapDraft draft = one.draft();
  EXPECT_FALSE(observe_scale(KeyframeId(4), {}, kDefaultFeatures, draft).observed);
  const SimulatedMap first = simulated_map(orbit(1), three_sides(), 1, 1.5, 1);
  map::MapDraft start = first.draft();
  EXPECT_FALSE(observe_scale(KeyframeId(0), {}, kDefaultFeatures, start).observed);
}

TEST(SelectSubmap, FreesAllExceptTheRootWhileTheScaleIsUnknown) {
  SimulatedMap world = simulated_map(orbit(1), three_sides(), 5, 1.0, 1);
  EXPECT_TRUE(needs_whole_submap(world.map, KeyframeId(4), {.keyframes = 5}));
  EXPECT_FALSE(needs_whole_submap(world.map, KeyframeId(4), {.keyframes = 4}));
  const adjustment::Selection s = select_submap(world.map, KeyframeId(4));
  EXPECT_EQ(s.fixed_keyframes, std::vector<KeyframeId>{KeyframeId(0)});
  EXPECT_EQ(s.free_keyframes.size(), 4u);
  EXPECT_EQ(s.landmarks, world.map.landmark_ids());
  world.map.set_scale(map::Scale::kMetric);
  EXPECT_FALSE(needs_whole_submap(world.map, KeyframeId(4), {.keyframes = 5}));
}

TEST(IsMetric, RequiresTwoMeasurementsAndASmallCorrection) {
  const ScaleReport sure{.observed = true, .correction = 1.01, .deviation = 0.01, .keyframes = 8};
  EXPECT_TRUE(is_metric(sure, 0.015, {}));
  EXPECT_FALSE(is_metric(sure, 0.03, {}));
  EXPECT_FALSE(is_metric({true, 1.01, 0.03, 8}, 0.015, {}));
  EXPECT_FALSE(is_metric({true, 1.10, 0.01, 8}, 0.015, {}));
  EXPECT_FALSE(is_metric({true, 1.01, 0.01, 3}, 0.015, {}));
  EXPECT_FALSE(is_metric({}, 0.015, {}));
}

}  // namespace
}  // namespace bslam::mapping
