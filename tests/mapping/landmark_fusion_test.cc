// Searches for landmarks in a keyframe of a simulated map with known correspondences.
#include "mapping/landmark_fusion.h"

#include <gtest/gtest.h>

#include "map/keyframe_landmarks.h"
#include "mapping/simulated_map.h"

namespace bslam::mapping {
namespace {

using map::SimulatedMap;
const feature::FeatureModel kSimulatedFeatures{.sigma_px = synthetic::FeatureSimulatorOptions().sigma_px,
                                               .pyramid = {}};
constexpr KeyframeId kFirst(0), kSecond(1), kThird(2);

synthetic::FeatureSimulator walk_simulator(camera::Rig rig) {
  synthetic::FeatureSimulatorOptions options;
  options.landmarks = 3000;
  options.max_keypoints = 500;
  return synthetic::FeatureSimulator(std::move(rig), synthetic::make_orbit({}), options);
}

// Keyframes 0 and 1 share their landmarks; keyframe 2 has its own, so that landmarks visible in all three are in the
// map twice.
SimulatedMap doubled_map(camera::Rig rig) {
  SimulatedMap world(walk_simulator(std::move(rig)));
  world.add_keyframe(FrameId(0), 0.0);
  world.add_keyframe(FrameId(1), 0.1);
  world.landmark_of.clear();
  world.add_keyframe(FrameId(2), 0.2);
  return world;
}

int truth_of(const SimulatedMap& world, LandmarkId l) { return world.truth_of_landmark.at(l.value()); }

// Returns the pairs of landmarks of `a` and of `b` that are the same landmark of the simulator.
std::vector<std::pair<LandmarkId, LandmarkId>> pairs(const SimulatedMap& world, KeyframeId a, KeyframeId b) {
  std::vector<std::pair<LandmarkId, LandmarkId>> out;
  for (const LandmarkId l : landmarks_of(world.map, a)) {
    for (const LandmarkId m : landmarks_of(world.map, b)) {
      if (l != m && truth_of(world, l) == truth_of(world, m)) out.emplace_back(l, m);
    }
  }
  return out;
}

class LandmarkFusion : public ::testing::TestWithParam<int> {
 protected:
  camera::Rig rig() const { return synthetic::ring_rig(GetParam()); }
};

TEST_P(LandmarkFusion, LandmarksOfAKeyframeAreSortedAndDistinct) {
  const SimulatedMap world = doubled_map(rig());
  const std::vector<LandmarkId> list = landmarks_of(world.map, kSecond);
  EXPECT_GT(list.size(), 100u);
  EXPECT_EQ(std::adjacent_find(list.begin(), list.end(), std::greater_equal<>()), list.end());
}

TEST_P(LandmarkFusion, AddsAnObservationAtAFreeFeature) {
  const SimulatedMap world = doubled_map(rig());
  map::MapDraft draft = world.draft();
  const std::vector<LandmarkId> searched = landmarks_of(world.map, kFirst);
  std::vector<std::pair<LandmarkId, FeatureId>> lost;
  for (const LandmarkId l : searched) {
    for (const map::Observation& o : world.map.observations(l)) {
      if (o.keyframe == kSecond) lost.emplace_back(l, o.feature);
    }
  }
  for (const auto& [l, feature] : lost) draft.remove_observation(l, kSecond);
  const std::ptrdiff_t before = num_observed(draft.map(), kSecond);
  fuse_into(kSecond, searched, Keep::kSearched, {}, kSimulatedFeatures, draft);
  int back = 0, elsewhere = 0;
  for (const auto& [l, feature] : lost) back += draft.map().landmark_of(kSecond, feature) == l;
  for (const LandmarkId l : landmarks_of(draft.map(), kSecond)) {
    for (const map::Observation& o : draft.map().observations(l)) {
      if (o.keyframe != kSecond || !std::ranges::binary_search(searched, l)) continue;
      EXPECT_FALSE(o.aligned);
      elsewhere += map::shown_by(world.frames[1], o.feature) != truth_of(world, l);
    }
  }
  EXPECT_GT(back, static_cast<int>(0.85 * static_cast<double>(lost.size())));
  EXPECT_LE(elsewhere, back / 100);
  EXPECT_GE(num_observed(draft.map(), kSecond) - before, back);
  EXPECT_EQ(draft.map().check_invariants(), std::nullopt);
}

TEST_P(LandmarkFusion, MergesLandmarksMatchedToTheSameFeature) {
  const SimulatedMap world = doubled_map(rig());
  const auto doubles = pairs(world, kSecond, kThird);
  ASSERT_GT(doubles.size(), 100u);
  map::MapDraft draft = world.draft();
  fuse_into(kThird, landmarks_of(world.map, kSecond), Keep::kSearched, {}, kSimulatedFeatures, draft);
  int one = 0, wrong = 0;
  for (const auto& [l, m] : doubles) one += draft.map().resolve(l) == draft.map().resolve(m);
  for (const LandmarkId l : world.map.landmark_ids()) {
    if (!draft.map().alive(l)) wrong += truth_of(world, l) != truth_of(world, draft.map().resolve(l));
  }
  EXPECT_GT(one, static_cast<int>(0.85 * static_cast<double>(doubles.size())));
  EXPECT_LE(wrong, one / 100);
  const std::size_t gone = world.map.num_landmarks() - draft.map().num_landmarks();
  EXPECT_EQ(draft.map().check_invariants(), std::nullopt);
  const auto is_merge = [](const map::Operation& o) { return std::holds_alternative<map::MergeLandmarks>(o); };
  EXPECT_EQ(static_cast<std::ptrdiff_t>(gone),
            std::ranges::count_if(std::move(draft).finish().edit.operations, is_merge));
}

// Landmarks of keyframe 1 that keyframe 0 also observes have two observations, landmarks of keyframe 2 have one. Both
// directions of the search are tested.
TEST_P(LandmarkFusion, KeepsTheLandmarkSelectedByTheArgument) {
  const SimulatedMap world = doubled_map(rig());
  const auto merged = [&](KeyframeId target, KeyframeId from, Keep keep) {
    map::MapDraft draft = world.draft();
    fuse_into(target, landmarks_of(world.map, from), keep, {}, kSimulatedFeatures, draft);
    int searched_died = 0, target_died = 0, less_observed_stayed = 0;
    for (const auto& [l, m] : pairs(world, from, target)) {
      if (draft.map().resolve(l) != draft.map().resolve(m)) continue;
      const bool died = !draft.map().alive(l);
      ++(died ? searched_died : target_died);
      const auto [kept, gone] = died ? std::pair(m, l) : std::pair(l, m);
      less_observed_stayed += world.map.observations(kept).size() < world.map.observations(gone).size();
    }
    return std::array{searched_died, target_died, less_observed_stayed};
  };
  for (const auto& [target, from] : {std::pair(kThird, kSecond), std::pair(kSecond, kThird)}) {
    const auto searched = merged(target, from, Keep::kSearched);
    EXPECT_EQ(searched[0], 0);
    EXPECT_GT(searched[1], 100);
    EXPECT_EQ(merged(target, from, Keep::kMoreObserved)[2], 0);
  }
  EXPECT_GT(merged(kSecond, kThird, Keep::kSearched)[2], 50);
  EXPECT_GT(merged(kSecond, kThird, Keep::kMoreObserved)[0], 50);
}

TEST_P(LandmarkFusion, SkipsLandmarksThatTheKeyframeAlreadyObserves) {
  const SimulatedMap world = doubled_map(rig());
  map::MapDraft draft = world.draft();
  fuse_into(kThird, landmarks_of(world.map, kThird), Keep::kSearched, {}, kSimulatedFeatures, draft);
  EXPECT_TRUE(std::move(draft).finish().edit.operations.empty());
}

TEST_P(LandmarkFusion, SkipsRemovedLandmarks) {
  const SimulatedMap world = doubled_map(rig());
  map::MapDraft draft = world.draft();
  const std::vector<LandmarkId> searched = landmarks_of(world.map, kSecond);
  for (const LandmarkId l : searched) draft.remove_landmark(l);
  const map::BundledMap before = draft.map();
  fuse_into(kThird, searched, Keep::kSearched, {}, kSimulatedFeatures, draft);
  EXPECT_EQ(draft.map().num_landmarks(), before.num_landmarks());
  EXPECT_EQ(draft.map().num_observations(), before.num_observations());
}

// Landmarks are displaced by half a degree: they are within the search radius, but only keypoints of coarse levels are
// accepted.
TEST_P(LandmarkFusion, RejectsKeypointsFarFromTheProjection) {
  SimulatedMap world = doubled_map(rig());
  const std::vector<LandmarkId> searched = landmarks_of(world.map, kSecond);
  const Eigen::Vector3d centre = world.frames[2].T_world_rig.translation();
  for (const LandmarkId l : searched) {
    const Eigen::Vector3d ray = world.map.landmark(l).position - centre;
    const Eigen::Vector3d sideways = ray.cross(Eigen::Vector3d::UnitZ()).normalized();
    world.map.set_position(l, world.map.landmark(l).position + 0.009 * ray.norm() * sideways);
  }
  LandmarkFusionOptions options;
  options.radius = 0.012;
  map::MapDraft strict = world.draft(), lenient = world.draft();
  fuse_into(kThird, searched, Keep::kSearched, options, kSimulatedFeatures, strict);
  const double chi2 = std::exchange(options.max_chi2, 1000);
  fuse_into(kThird, searched, Keep::kSearched, options, kSimulatedFeatures, lenient);
  EXPECT_GT(strict.map().num_landmarks(), lenient.map().num_landmarks() + 100);
  for (const LandmarkId l : landmarks_of(strict.map(), kThird)) {
    if (!std::ranges::binary_search(searched, l)) continue;
    double min_chi2 = 1e9;  // minimum over the feature's keypoints, one of which was accepted
    const auto o = std::ranges::find(strict.map().observations(l), kThird, &map::Observation::keyframe);
    const map::BundledKeyframe& target = strict.map().keyframe(kThird);
    for (const frame::KeypointRef r : target.frame->bundled.keypoints(o->feature)) {
      const camera::Rig& cameras = strict.map().rig();
      const Eigen::Vector3d in_camera =
          cameras.cam_from_rig(r.camera) * (target.T_rig_world * strict.map().landmark(l).position);
      const feature::Keypoints& keypoints = target.frame->keypoints(r.camera);
      const double sigma = kSimulatedFeatures.sigma(keypoints.level[r.keypoint.index()]);
      const Eigen::Vector2d error =
          keypoints.pixel[r.keypoint.index()].cast<double>() - *cameras.camera(r.camera).project(in_camera);
      min_chi2 = std::min(min_chi2, error.squaredNorm() / (sigma * sigma));
    }
    EXPECT_LT(min_chi2, chi2);
  }
}

INSTANTIATE_TEST_SUITE_P(Cameras, LandmarkFusion, ::testing::Values(1, 2, 4));

// The rig has rotated by a right angle, so the left camera observes landmarks that the front cameras observed.
TEST(LandmarkFusionAcrossCameras, MatchesLandmarksOfOtherCameras) {
  SimulatedMap world(walk_simulator(synthetic::default_rig()));
  world.add_keyframe(FrameId(0), 0.0);
  world.landmark_of.clear();
  world.add_keyframe(FrameId(1), 3.0);
  map::MapDraft draft = world.draft();
  fuse_into(kSecond, landmarks_of(world.map, kFirst), Keep::kSearched, {}, kSimulatedFeatures, draft);
  int across = 0;
  for (const LandmarkId l : landmarks_of(draft.map(), kSecond)) {
    const auto list = draft.map().observations(l);
    if (list.size() < 2) continue;
    const auto camera = [&](const map::Observation& o) {
      return draft.map().keyframe(o.keyframe).frame->bundled.keypoints(o.feature).front().camera;
    };
    across += camera(list[0]) != camera(list[1]);
  }
  EXPECT_GT(across, 30);
  EXPECT_EQ(draft.map().check_invariants(), std::nullopt);
}

}  // namespace
}  // namespace bslam::mapping
