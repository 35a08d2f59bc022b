// Local mapping: creation and fusion of landmarks, the local window, and the stage as a whole.
#include <gtest/gtest.h>

#include <set>

#include "mapping/create_landmarks.h"
#include "mapping/local_adjustment.h"
#include "mapping/map_keyframe.h"
#include "mapping/simulated_map.h"

namespace bslam::mapping {
namespace {

using map::SimulatedMap;
const FeatureModel kFeatures;

synthetic::FeatureSimulator simulator(camera::Rig rig, double period_s = 12.0) {
  synthetic::FeatureSimulatorOptions options;
  options.landmarks = 4000;
  options.max_keypoints = 700;
  return synthetic::FeatureSimulator(std::move(rig), synthetic::make_orbit({.period_s = period_s}), options);
}

// A map with landmarks for matched features only; mapping creates the monocular ones.
SimulatedMap stereo_map(camera::Rig rig, int keyframes, double period_s = 12.0) {
  SimulatedMap out(simulator(std::move(rig), period_s));
  for (int i = 0; i < keyframes; ++i) out.add_keyframe(FrameId(i), 0.3 * i, false);
  return out;
}

// The simulator's landmarks that the observations of a landmark belong to; contains -1 for an outlier.
std::set<int> shown(const SimulatedMap& world, const map::BundledMap& map, LandmarkId l) {
  std::set<int> out;
  for (const map::Observation& o : map.observations(l))
    out.insert(map::shown_by(world.frames[o.keyframe.index()], o.feature));
  return out;
}

// Creates landmarks and returns the number of those added.
std::size_t created_landmarks(KeyframeId keyframe, const CreationOptions& options, map::MapDraft& draft) {
  const std::size_t before = draft.map().num_landmarks();
  create_landmarks(keyframe, options, kFeatures, draft);
  return draft.map().num_landmarks() - before;
}

TEST(CreateLandmarks, CreatesLandmarksNearTheirTruePositions) {
  const camera::Rig rigs[] = {synthetic::ring_rig(2), synthetic::default_rig(), synthetic::mixed_rig()};
  for (const camera::Rig& rig : rigs) {
    const SimulatedMap world = stereo_map(rig, 4);
    map::MapDraft draft = world.draft();
    const std::size_t before = draft.map().landmark_slots();
    const std::size_t made = created_landmarks(KeyframeId(3), {}, draft);
    ASSERT_EQ(draft.map().landmark_slots(), before + made);
    EXPECT_GT(made, 50u);
    std::size_t pure = 0, near = 0;
    for (std::size_t i = before; i < draft.map().landmark_slots(); ++i) {
      const std::set<int> truth = shown(world, draft.map(), LandmarkId(i));
      EXPECT_EQ(draft.map().observations(LandmarkId(i)).size(), 2u);
      if (truth.size() != 1 || *truth.begin() < 0) continue;
      ++pure;
      const Eigen::Vector3d& place = world.truth_of(*truth.begin());
      const double distance = (place - world.frames[3].T_world_rig.translation()).norm();
      near +=
          // two standard deviations at the bound
          (draft.map().landmark(LandmarkId(i)).position - place).norm() < 0.3 * distance;
    }
    EXPECT_GT(static_cast<double>(pure), 0.97 * static_cast<double>(made));
    EXPECT_GT(static_cast<double>(near), 0.92 * static_cast<double>(pure));
    EXPECT_EQ(draft.map().check_invariants(), std::nullopt);
  }
}

TEST(CreateLandmarks, MatchesBetweenDifferentCameras) {
  const SimulatedMap world =
      // 72 degrees per second: the side cameras soon observe landmarks that the front cameras observed
      stereo_map(synthetic::default_rig(), 5, 5.0);
  map::MapDraft draft = world.draft();
  const std::size_t before = draft.map().landmark_slots();
  create_landmarks(KeyframeId(4), {}, kFeatures, draft);
  int across = 0;
  for (std::size_t i = before; i < draft.map().landmark_slots(); ++i) {
    std::set<CameraIndex> cameras;
    bool front = false, side = false;
    for (const map::Observation& o : draft.map().observations(LandmarkId(i))) {
      for (const frame::KeypointRef r : draft.map().keyframe(o.keyframe).frame->bundled.keypoints(o.feature)) {
        front |= r.camera.value() < 2;
        side |= r.camera.value() >= 2;
      }
    }
    across += front && side;
  }
  EXPECT_GT(across, 10);
}

TEST(CreateLandmarks, CreatesNoneWithoutABaseline) {
  SimulatedMap world(simulator(synthetic::ring_rig(2)));
  world.add_keyframe(FrameId(0), 0.5, false);
  world.add_keyframe(FrameId(1), 0.5, false);
  map::MapDraft draft = world.draft();
  EXPECT_EQ(created_landmarks(KeyframeId(1), {}, draft), 0u);
}

// Camera 0 stays at its place, but the others move.
TEST(CreateLandmarks, CreatesLandmarksWhileTheRigTurnsAboutCamera0) {
  const camera::Rig ring = synthetic::ring_rig(4);
  std::vector<camera::RigCamera> cameras;
  for (std::size_t c = 0; c < ring.size(); ++c)
    cameras.push_back({ring.camera(c), ring.body_from_cam(0).inverse() * ring.body_from_cam(c)});
  std::vector<synthetic::ControlPose> control;
  for (int i = 0; i < 6; ++i) control.push_back({{0.3, 0.2, 1.5}, 0.4 * i, 0.0, 0.0});
  synthetic::FeatureSimulatorOptions options;
  options.landmarks = 3000;
  options.max_keypoints = 700;
  SimulatedMap world(
      synthetic::FeatureSimulator(camera::Rig(std::move(cameras)), synthetic::Trajectory(control, 1.0), options));
  for (int i = 0; i < 3; ++i) world.add_keyframe(FrameId(i), 0.5 * i, false);
  ASSERT_LT(map::distance_m(world.true_pose(KeyframeId(0)), world.true_pose(KeyframeId(2))), 1e-9);
  map::MapDraft draft = world.draft();
  EXPECT_GT(created_landmarks(KeyframeId(2), {}, draft), 20u);
}

TEST(CreateLandmarks, CreatesAtMostOneLandmarkPerFeature) {
  const SimulatedMap world = stereo_map(synthetic::ring_rig(3), 4);
  map::MapDraft draft = world.draft();
  create_landmarks(KeyframeId(3), {}, kFeatures, draft);
  EXPECT_LT(created_landmarks(KeyframeId(3), {}, draft), 40u);  // new observations resolve earlier ambiguities
  EXPECT_EQ(draft.map().check_invariants(), std::nullopt);
}

TEST(CreateLandmarks, CreatesNoneWithZeroNeighbours) {
  const SimulatedMap world = stereo_map(synthetic::ring_rig(2), 4);
  map::MapDraft draft = world.draft();
  EXPECT_EQ(created_landmarks(KeyframeId(3), {.neighbours = 0}, draft), 0u);
  const adjustment::Selection single = select_local(world.map, KeyframeId(3), {.free_keyframes = 1});
  EXPECT_EQ(single.free_keyframes.size(), 1u);
}

class FuseLandmarks : public ::testing::Test {
 protected:
  // A map in which every keyframe has its own landmarks, so that every landmark shared by two keyframes is duplicated.
  static SimulatedMap doubled_map() {
    SimulatedMap world(simulator(synthetic::ring_rig(2)));
    world.add_keyframe(FrameId(0), 0.0);
    world.add_keyframe(FrameId(1), 0.2);
    world.add_keyframe(FrameId(2), 0.4);
    return world;
  }
};

TEST_F(FuseLandmarks, MergesPlantedDuplicates) {
  SimulatedMap world = doubled_map();
  const KeyframeId last(2);
  std::vector<std::pair<LandmarkId, LandmarkId>> twins;
  for (const LandmarkId l : world.map.landmark_ids()) {
    const auto list = world.map.observations(l);
    if (list.size() < 2 || list.back().keyframe != last || l.value() % 3 != 0) continue;
    const map::Observation o = list.back();
    ASSERT_TRUE(world.map.remove_observation(l, last));
    twins.emplace_back(l, world.map.add_landmark(world.map.landmark(l).position + Eigen::Vector3d(0.002, -0.002, 0.001),
                                                 std::span(&o, 1)));
  }
  ASSERT_GT(twins.size(), 30u);
  map::MapDraft draft = world.draft();
  fuse_landmarks(last, {}, kFeatures, draft);
  std::size_t joined = 0;
  for (const auto& [a, b] : twins)
    joined += draft.map().resolve(a).valid() && draft.map().resolve(a) == draft.map().resolve(b);
  EXPECT_GT(static_cast<double>(joined), 0.7 * static_cast<double>(twins.size()));
  EXPECT_GE(world.map.num_landmarks() - draft.map().num_landmarks(), joined);
  EXPECT_EQ(draft.map().check_invariants(), std::nullopt);
}

TEST_F(FuseLandmarks, AddsMissingObservations) {
  SimulatedMap world = doubled_map();
  const KeyframeId last(2);
  std::size_t removed = 0;
  for (const LandmarkId l : world.map.landmark_ids()) {
    const auto list = world.map.observations(l);
    if (list.size() < 2 || list.back().keyframe != last || l.value() % 3 != 0) continue;
    removed += world.map.remove_observation(l, last);
  }
  map::MapDraft draft = world.draft();
  fuse_landmarks(last, {}, kFeatures, draft);
  EXPECT_GT(static_cast<double>(num_observed(draft.map(), last) - num_observed(world.map, last)),
            0.7 * static_cast<double>(removed));
  EXPECT_EQ(draft.map().check_invariants(), std::nullopt);
}

TEST_F(FuseLandmarks, RarelyMergesDifferentLandmarks) {
  const SimulatedMap world = doubled_map();
  map::MapDraft draft = world.draft();
  fuse_landmarks(KeyframeId(2), {}, kFeatures, draft);
  std::size_t mixed = 0;
  for (const LandmarkId l : draft.map().landmark_ids()) mixed += shown(world, draft.map(), l).size() > 1;
  EXPECT_LT(mixed, draft.map().num_landmarks() / 50);
}

TEST_F(FuseLandmarks, WorksIfACameraHasNoImage) {
  SimulatedMap world = doubled_map();
  auto gap = std::make_shared<frame::BundledFrame>(world.sim.frame(FrameId(3), 0.5, std::vector<int>{1}).frame);
  std::vector<std::pair<FeatureId, LandmarkId>> matches;
  const auto truth = world.sim.frame(FrameId(3), 0.5, std::vector<int>{1});
  for (std::size_t f = 0; f < gap->bundled.size(); f += 2) {
    const auto at = world.landmark_of.find(map::shown_by(truth, FeatureId(f)));
    if (at != world.landmark_of.end()) matches.emplace_back(f, at->second);
  }
  const KeyframeId k = world.map.add_keyframe(gap, truth.T_world_rig.inverse(), matches, KeyframeId(2));
  map::MapDraft draft = world.draft();
  fuse_landmarks(k, {}, kFeatures, draft);
  EXPECT_GT(num_observed(draft.map(), k) - num_observed(world.map, k), 10);
  EXPECT_EQ(draft.map().check_invariants(), std::nullopt);
}

TEST(SelectLocal, FixesTheRootAndTheKeyframesOutsideTheWindow) {
  const SimulatedMap world = stereo_map(synthetic::ring_rig(2), 8);
  const adjustment::Selection s = select_local(world.map, KeyframeId(7), {.free_keyframes = 3, .fixed_keyframes = 4});
  EXPECT_EQ(s.free_keyframes.size(), 3u);
  EXPECT_TRUE(std::binary_search(s.free_keyframes.begin(), s.free_keyframes.end(), KeyframeId(7)));
  EXPECT_FALSE(std::binary_search(s.free_keyframes.begin(), s.free_keyframes.end(), KeyframeId(0)));
  EXPECT_LE(s.fixed_keyframes.size(), 4u);
  EXPECT_GE(s.fixed_keyframes.size(), 1u);
  for (const KeyframeId k : s.fixed_keyframes)
    EXPECT_FALSE(std::binary_search(s.free_keyframes.begin(), s.free_keyframes.end(), k));
  EXPECT_TRUE(std::is_sorted(s.fixed_keyframes.begin(), s.fixed_keyframes.end()));
  EXPECT_TRUE(std::is_sorted(s.landmarks.begin(), s.landmarks.end()));
}

TEST(SelectLocal, SelectsTheLandmarksObservedMostOften) {
  const SimulatedMap world = stereo_map(synthetic::ring_rig(2), 6);
  const adjustment::Selection s = select_local(world.map, KeyframeId(5), {.max_landmarks = 50});
  ASSERT_EQ(s.landmarks.size(), 50u);
  std::size_t min_observations = 100;
  for (const LandmarkId l : s.landmarks)
    min_observations = std::min(min_observations, world.map.observations(l).size());
  EXPECT_GE(min_observations, 3u);
}

TEST(SelectLocal, FixesTwoPosesIfTheScaleIsArbitrary) {
  SimulatedMap world = stereo_map(synthetic::ring_rig(2), 5);
  world.map.set_scale(map::Scale::kUpToScale);
  EXPECT_GE(select_local(world.map, KeyframeId(4), {}).fixed_keyframes.size(), 2u);
  EXPECT_EQ(select_all(world.map).fixed_keyframes.size(), 2u);
  world.map.set_scale(map::Scale::kMetric);
  EXPECT_EQ(select_all(world.map).fixed_keyframes, std::vector<KeyframeId>{KeyframeId(0)});
}

TEST(MapKeyframe, BuildsAnAccurateMap) {
  const camera::Rig rigs[] = {synthetic::ring_rig(2), synthetic::mixed_rig()};
  for (const camera::Rig& rig : rigs) {
    SimulatedMap world(simulator(rig));
    Random random(3, "drift");
    std::size_t created = 0;
    for (int i = 0; i < 7; ++i) {
      const KeyframeId k = world.add_keyframe(FrameId(i), 0.3 * i, false);
      if (i == 0) continue;
      geometry::Vector6d drift;
      for (int j = 0; j < 6; ++j) drift[j] = 0.003 * random.normal();
      world.map.set_pose(k, world.map.keyframe(k).T_rig_world.perturbed(drift));
      map::MapDraft draft = world.draft();
      map_keyframe(k, {}, kFeatures, draft);
      EXPECT_GT(map::distance_m(draft.map().keyframe(k).T_rig_world, world.map.keyframe(k).T_rig_world), 0.0);
      created += draft.map().landmark_slots() - world.map.landmark_slots();
      ASSERT_EQ(draft.map().check_invariants(), std::nullopt) << "keyframe " << i;
      world.map = std::move(draft).finish().result;
      for (auto& [truth, l] : world.landmark_of) l = world.map.resolve(l);
      std::erase_if(world.landmark_of, [](const auto& entry) { return !entry.second.valid(); });
    }
    EXPECT_GT(created, 200u);  // of about 600 features per camera and keyframe, most of which already have a landmark
    for (const KeyframeId k : world.map.keyframe_ids()) {
      EXPECT_LT(map::distance_m(world.map.keyframe(k).T_rig_world, world.true_pose(k)), 0.02)
          << "keyframe " << k.value();
    }
    std::size_t mixed = 0, several = 0;
    for (const LandmarkId l : world.map.landmark_ids()) {
      if (world.map.observations(l).size() < 2) continue;
      ++several;
      mixed += shown(world, world.map, l).size() > 1;
    }
    EXPECT_LT(static_cast<double>(mixed), 0.02 * static_cast<double>(several));
  }
}

TEST(MapKeyframe, LeavesAValidMapWhenStopped) {
  const SimulatedMap world = stereo_map(synthetic::ring_rig(2), 4);
  std::stop_source stop;
  stop.request_stop();
  map::MapDraft draft = world.draft();
  map_keyframe(KeyframeId(3), {}, kFeatures, draft, stop.get_token());
  EXPECT_EQ(draft.map().check_invariants(), std::nullopt);
}

TEST(MapKeyframe, EstimatesTheUncertaintyOfTheKeyframeOnly) {
  const SimulatedMap world = stereo_map(synthetic::ring_rig(2), 4);
  map::MapDraft draft = world.draft();
  map_keyframe(KeyframeId(3), {}, kFeatures, draft);
  for (int k = 0; k < 3; ++k)
    EXPECT_EQ(draft.map().keyframe(KeyframeId(k)).uncertainty.noise, geometry::Matrix6d::Zero()) << k;
  const geometry::Matrix6d& covariance = draft.map().keyframe(KeyframeId(3)).uncertainty.noise;
  const geometry::Vector6d deviations = covariance.diagonal().cwiseSqrt();
  EXPECT_GT(deviations.head<3>().norm(), 1e-4);  // rad; noise of 0.7 px
  EXPECT_LT(deviations.head<3>().norm(), 1e-2);
  EXPECT_GT(deviations.tail<3>().norm(), 1e-3);  // metres
  EXPECT_LT(deviations.tail<3>().norm(), 1e-1);
}

TEST(AdjustGlobally, EstimatesTheUncertaintyOfAllKeyframesButTheRoot) {
  SimulatedMap world(simulator(synthetic::ring_rig(2)));
  for (int i = 0; i < 4; ++i) world.add_keyframe(FrameId(i), 0.3 * i);
  map::MapDraft draft = world.draft();
  ASSERT_TRUE(adjust_globally({}, kFeatures, draft));
  EXPECT_EQ(draft.map().keyframe(KeyframeId(0)).uncertainty.noise, geometry::Matrix6d::Zero());
  for (int k = 1; k < 4; ++k)
    EXPECT_GT(draft.map().keyframe(KeyframeId(k)).uncertainty.noise.diagonal().minCoeff(), 0.0) << k;

  world.map.set_scale(map::Scale::kUnobservable);  // without the scale they are not determined
  map::MapDraft undetermined = world.draft();
  ASSERT_TRUE(adjust_globally({}, kFeatures, undetermined));
  for (int k = 0; k < 4; ++k)
    EXPECT_EQ(undetermined.map().keyframe(KeyframeId(k)).uncertainty.noise, geometry::Matrix6d::Zero()) << k;
}

TEST(AdjustGlobally, ImprovesAPerturbedMap) {
  SimulatedMap world(simulator(synthetic::ring_rig(2)));
  for (int i = 0; i < 6; ++i) world.add_keyframe(FrameId(i), 0.3 * i);
  Random random(4, "drift");
  double before = 0, after = 0;
  for (int i = 1; i < 6; ++i) {
    geometry::Vector6d drift;
    for (int j = 0; j < 6; ++j) drift[j] = 0.01 * random.normal();
    world.map.set_pose(KeyframeId(i), world.map.keyframe(KeyframeId(i)).T_rig_world.perturbed(drift));
    before += map::distance_m(world.map.keyframe(KeyframeId(i)).T_rig_world, world.true_pose(KeyframeId(i)));
  }
  map::MapDraft draft = world.draft();
  ASSERT_TRUE(adjust_globally({}, kFeatures, draft));
  for (int i = 1; i < 6; ++i)
    after += map::distance_m(draft.map().keyframe(KeyframeId(i)).T_rig_world, world.true_pose(KeyframeId(i)));
  EXPECT_LT(after, 0.4 * before);
  EXPECT_EQ(draft.map().check_invariants(), std::nullopt);
}

}  // namespace
}  // namespace bslam::mapping
