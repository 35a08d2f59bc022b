#include "tracking/initialise.h"

#include <gtest/gtest.h>

#include "geometry/alignment.h"
#include "geometry/triangulation.h"
#include "tracking/simulated_tracker.h"

namespace bslam::tracking {
namespace {

using geometry::SE3;

map::MapDraft empty_draft(const synthetic::FeatureSimulator& sim) {
  return map::MapDraft(std::make_shared<const map::BundledMap>(std::make_shared<const camera::Rig>(sim.rig())));
}

TEST(InitialiseMetric, CreatesLandmarksAtTheirTruePositions) {
  const auto sim = simulator(synthetic::ring_rig(2));
  const auto seen = sim.frame(FrameId(0), 0.0);
  map::MapDraft draft = empty_draft(sim);
  const auto started = initialise_metric(seen.frame, map::flat_pyramids(2), {}, draft);
  ASSERT_TRUE(started.has_value());
  ASSERT_EQ(started->keyframes.size(), 1u);
  EXPECT_EQ(started->scale, map::Scale::kMetric);
  const map::BundledMap& map = draft.map();
  EXPECT_EQ(map.check_invariants(), std::nullopt);
  EXPECT_EQ(map.keyframe(KeyframeId(0)).T_rig_world.translation().norm(), 0.0);
  EXPECT_GT(map.num_landmarks(), 60u);
  for (const LandmarkId l : map.landmark_ids()) {
    const frame::KeypointRef r = map.landmark(l).reference.keypoint;
    const int truth = seen.landmark[r.camera.index()][r.keypoint.index()];
    ASSERT_GE(truth, 0);
    const Eigen::Vector3d true_rig =
        seen.T_world_rig.inverse() * sim.landmarks()[static_cast<std::size_t>(truth)].position;
    EXPECT_LT((map.landmark(l).position - true_rig).norm(),
              0.8 * true_rig.norm());  // 15 % depth error, more than four sigmas
  }
}

TEST(InitialiseMetric, FailsWithTooFewMatchedFeatures) {
  const auto sim = simulator(synthetic::ring_rig(2));
  const std::vector<int> missing = {1};
  map::MapDraft draft = empty_draft(sim);
  EXPECT_FALSE(
      initialise_metric(sim.frame(FrameId(0), 0.0, missing).frame, map::flat_pyramids(2), {}, draft).has_value());
  EXPECT_EQ(draft.map().num_keyframes(), 0u);
}

TEST(InitialiseMetric, FailsIfAllPointsAreTooFarForAccurateDepth) {
  synthetic::FeatureSimulatorOptions options = room();
  options.room_low = {-60, -60, -60};
  options.room_high = {60, 60, 60};
  options.nearest_base = 60;
  options.farthest_base = 160;
  const auto sim = simulator(synthetic::ring_rig(2), options);
  map::MapDraft draft = empty_draft(sim);
  const auto started = initialise_metric(sim.frame(FrameId(0), 0.0).frame, map::flat_pyramids(2), {}, draft);
  EXPECT_TRUE(!started || draft.map().num_landmarks() >= 60u) << draft.map().num_landmarks() << " landmarks";
}

class InitialiseMonocular : public ::testing::Test {
 protected:
  std::optional<StartedMap> start(const synthetic::SimulatedFrame& first, const synthetic::SimulatedFrame& second,
                                  map::MapDraft& draft, const InitialisationOptions& options = {}) {
    const StartCandidate candidate{std::make_shared<const frame::BundledFrame>(first.frame),
                                   map::flat_pyramids(first.frame.cameras.size())};
    const auto pyramids = map::flat_pyramids(first.frame.cameras.size());
    return initialise_monocular({candidate, second.frame, pyramids, {}}, options, Random(1), draft);
  }
  // Ahead and 120 degrees to either side.
  static camera::Rig three_sides(int width = 752) {
    const std::vector<int> sides = {0, 2, 3};
    return synthetic::ring_rig(4, width).subset(sides);
  }
  struct ScaleFound {
    double ratio = 0;      // of the estimated to the true distance of the two frames
    double deviation = 0;  // its estimated relative standard deviation
  };
  // Starts in several rooms from two frames, which must not suffice for a metric scale.
  std::vector<ScaleFound> scales_without_overlap(const camera::Rig& rig, std::uint64_t num_rooms);
};

TEST_F(InitialiseMonocular, EstimatesMotionAndStructureUpToScale) {
  const auto sim = simulator(synthetic::ring_rig(1), room(1, 0.25), {.radius = 2.2, .period_s = 20});
  const auto first = sim.frame(FrameId(0), 0.0);
  auto second = first;
  map::MapDraft draft = empty_draft(sim);
  std::optional<StartedMap> started;
  for (int i = 1; i <= 30 && !started; ++i) {  // until there is enough parallax
    second = sim.frame(FrameId(i), 0.05 * i);
    started = start(first, second, draft);
  }
  ASSERT_TRUE(started.has_value());
  EXPECT_EQ(started->scale, map::Scale::kUpToScale);
  ASSERT_EQ(started->keyframes.size(), 2u);
  const map::BundledMap& map = draft.map();
  EXPECT_EQ(map.check_invariants(), std::nullopt);
  const SE3 found = map.keyframe(KeyframeId(1)).T_rig_world, truth = second.T_world_rig.inverse() * first.T_world_rig;
  EXPECT_LT(map::angle_rad(found, truth), 0.5 * kDegree);
  EXPECT_LT(std::acos(found.translation().normalized().dot(truth.translation().normalized())), 5 * kDegree);

  std::vector<Eigen::Vector3d> estimated, true_places;
  std::vector<double> depth;
  for (const LandmarkId l : map.landmark_ids()) {
    const frame::KeypointRef r = map.landmark(l).reference.keypoint;
    const int shown = first.landmark[r.camera.index()][r.keypoint.index()];
    depth.push_back(map.landmark(l).position.norm());
    if (shown < 0) continue;
    estimated.push_back(map.landmark(l).position);
    true_places.push_back(first.T_world_rig.inverse() * sim.landmarks()[static_cast<std::size_t>(shown)].position);
  }
  ASSERT_GT(estimated.size(), 50u);
  std::nth_element(depth.begin(), depth.begin() + static_cast<std::ptrdiff_t>(depth.size() / 2), depth.end());
  EXPECT_NEAR(depth[depth.size() / 2], 1.0, 0.05);
  const double scale = truth.translation().norm() / found.translation().norm();
  std::vector<double> relative;
  for (std::size_t i = 0; i < estimated.size(); ++i)
    relative.push_back((scale * estimated[i] - true_places[i]).norm() / true_places[i].norm());
  std::nth_element(relative.begin(), relative.begin() + static_cast<std::ptrdiff_t>(relative.size() / 2),
                   relative.end());
  EXPECT_LT(relative[relative.size() / 2], 0.1);
}

TEST_F(InitialiseMonocular, FailsWithoutParallax) {
  const auto sim = simulator(synthetic::ring_rig(1));
  map::MapDraft draft = empty_draft(sim);
  EXPECT_FALSE(start(sim.frame(FrameId(0), 0.0), sim.frame(FrameId(1), 0.0), draft).has_value());
  EXPECT_FALSE(start(sim.frame(FrameId(0), 0.0), sim.frame(FrameId(1), 0.02), draft).has_value());
  EXPECT_EQ(draft.map().num_keyframes(), 0u);
}

TEST_F(InitialiseMonocular, FailsForFramesOfTwoPlaces) {
  const auto sim = simulator(synthetic::ring_rig(1));
  map::MapDraft draft = empty_draft(sim);
  EXPECT_FALSE(start(sim.frame(FrameId(0), 0.0), sim.frame(FrameId(1), 6.0), draft).has_value());
  const auto elsewhere = simulator(synthetic::ring_rig(1), room(42));
  EXPECT_FALSE(start(sim.frame(FrameId(0), 0.0), elsewhere.frame(FrameId(1), 0.3), draft).has_value());
}

auto InitialiseMonocular::scales_without_overlap(const camera::Rig& rig, std::uint64_t num_rooms)
    -> std::vector<ScaleFound> {
  std::vector<ScaleFound> out;
  EXPECT_FALSE(rig.any_overlap());
  for (std::uint64_t seed = 1; seed <= num_rooms; ++seed) {
    const auto sim = simulator(rig, room(seed, 0.25), {.seed = seed});
    const auto first = sim.frame(FrameId(0), 0.0);
    auto second = first;
    map::MapDraft draft = empty_draft(sim);
    std::optional<StartedMap> started;
    for (int i = 6; i <= 20 && !started; ++i) {
      second = sim.frame(FrameId(i), 0.05 * i);
      started = start(first, second, draft);
    }
    if (!started) continue;
    EXPECT_EQ(started->scale, map::Scale::kUnobservable);
    EXPECT_EQ(draft.map().check_invariants(), std::nullopt);
    if (!std::isfinite(started->scale_deviation)) continue;
    EXPECT_LE(started->scale_deviation, 1.0);
    const SE3 found = draft.map().keyframe(KeyframeId(1)).T_rig_world,
              truth = second.T_world_rig.inverse() * first.T_world_rig;
    EXPECT_LT(map::angle_rad(found, truth), 0.5 * kDegree);
    out.push_back({found.translation().norm() / truth.translation().norm(), started->scale_deviation});
  }
  return out;
}

TEST_F(InitialiseMonocular, ARotatingRigWithoutOverlapIsInitialisedAtApproximateScale) {
  const std::vector<ScaleFound> found = scales_without_overlap(three_sides(), 4);
  EXPECT_GE(found.size(), 3u);
  for (const ScaleFound& scale : found) EXPECT_NEAR(scale.ratio, 1.0, 0.3);
}

// The pixels of small images are larger than the usual bound for matches, so that right ones would be left out.
TEST_F(InitialiseMonocular, TheScaleOfSmallImagesIsAsUncertainAsItSays) {
  const std::vector<ScaleFound> found = scales_without_overlap(three_sides(376), 12);
  ASSERT_GE(found.size(), 5u);
  double squared_z = 0;
  for (const ScaleFound& scale : found) squared_z += std::pow(std::log(scale.ratio) / scale.deviation, 2);
  EXPECT_LT(squared_z / static_cast<double>(found.size()), 1.0);
}

// A start of overlapping cameras that have too few features with accurate depth for a metric one.
TEST_F(InitialiseMonocular, AgreesWithTheDepthOfMatchedFeatures) {
  const auto sim = simulator(synthetic::ring_rig(2), room(1, 0.25), {.radius = 2.2, .period_s = 20});
  const auto first = sim.frame(FrameId(0), 0.0);
  auto second = first;
  InitialisationOptions options;
  options.assumed_median_depth = 100.0;
  map::MapDraft draft = empty_draft(sim);
  std::optional<StartedMap> started;
  for (int i = 1; i <= 30 && !started; ++i) {
    second = sim.frame(FrameId(i), 0.05 * i);
    started = start(first, second, draft, options);
  }
  ASSERT_TRUE(started.has_value());
  EXPECT_EQ(started->scale, map::Scale::kUnobservable);
  EXPECT_LE(started->scale_deviation, 0.1);
  const SE3 found = draft.map().keyframe(KeyframeId(1)).T_rig_world,
            truth = second.T_world_rig.inverse() * first.T_world_rig;
  EXPECT_NEAR(found.translation().norm() / truth.translation().norm(), 1.0, 0.1);
  std::size_t in_two_frames = 0;
  for (const LandmarkId l : draft.map().landmark_ids()) {
    for (const map::Observation& o : draft.map().observations(l)) {
      const bool reference = o.keyframe == draft.map().landmark(l).reference.keyframe;
      EXPECT_EQ(o.aligned, reference) << "matched by its descriptor";
      in_two_frames += !reference;
    }
  }
  EXPECT_GE(in_two_frames, 10u);
}

TEST_F(InitialiseMonocular, AssumesTheDepthIfTwoFramesDoNotDetermineTheScale) {
  const auto sim = simulator(three_sides(), room(1, 0.25));
  map::MapDraft draft = empty_draft(sim);
  InitialisationOptions options;
  options.max_scale_deviation = 1e-3;
  options.assumed_median_depth = 20.0;
  const auto started = start(sim.frame(FrameId(0), 0.0), sim.frame(FrameId(1), 0.3), draft, options);
  ASSERT_TRUE(started.has_value());
  EXPECT_EQ(started->scale, map::Scale::kUnobservable);
  EXPECT_TRUE(std::isinf(started->scale_deviation));
  std::vector<double> depth;
  for (const LandmarkId l : draft.map().landmark_ids()) depth.push_back(draft.map().landmark(l).position.norm());
  std::nth_element(depth.begin(), depth.begin() + static_cast<std::ptrdiff_t>(depth.size() / 2), depth.end());
  EXPECT_NEAR(depth[depth.size() / 2], 20.0, 2.0);
}

TEST_F(InitialiseMonocular, AssumesAMapInWhichCamerasMoveInOneDirection) {
  const auto sim = simulator(three_sides(), room(1, 0.25));
  map::MapDraft draft = empty_draft(sim);
  InitialisationOptions options;
  options.max_scale_deviation = 1e-3;
  options.assumed_median_depth = 1e-3;
  ASSERT_TRUE(start(sim.frame(FrameId(0), 0.0), sim.frame(FrameId(1), 0.3), draft, options).has_value());
  const SE3 motion = draft.map().keyframe(KeyframeId(1)).T_rig_world;
  for (std::size_t c = 1; c < sim.rig().size(); ++c) {
    const SE3 of_camera = sim.rig().cam_from_rig(c) * motion * sim.rig().rig_from_cam(c);
    const Eigen::Vector3d in_rig = sim.rig().rig_from_cam(c).rotation() * of_camera.translation();
    EXPECT_LT(geometry::angle_between(in_rig, motion.translation()), 0.06) << c;
  }
}

}  // namespace
}  // namespace bslam::tracking
