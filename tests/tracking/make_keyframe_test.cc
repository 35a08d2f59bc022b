#include "tracking/make_keyframe.h"

#include <gtest/gtest.h>

#include <set>

#include "tracking/simulated_tracker.h"

namespace bslam::tracking {
namespace {

using frame::KeypointRef;

// unique = monocular + matched; every keypoint in one feature; one keypoint per camera.
void expect_consistent_table(const frame::BundledFrame& frame) {
  std::size_t keypoints = 0;
  EXPECT_EQ(frame.bundled.size(), frame.bundled.num_matched() + frame.bundled.num_monocular());
  for (std::size_t f = 0; f < frame.bundled.size(); ++f) {
    const auto refs = frame.bundled.keypoints(FeatureId(f));
    EXPECT_EQ(refs.size() >= 2, frame.bundled.is_matched(FeatureId(f)));
    std::set<CameraIndex> cameras;
    for (const KeypointRef r : refs) {
      EXPECT_TRUE(cameras.insert(r.camera).second);
      EXPECT_EQ(frame.bundled.feature(r), FeatureId(f));
    }
    keypoints += refs.size();
  }
  EXPECT_EQ(keypoints, frame.num_keypoints());
}

class MakeKeyframe : public ::testing::Test {
 protected:
  void SetUp() override {
    for (std::size_t c = 0; c < seen.frame.cameras.size(); ++c) {
      matches.emplace_back();
      for (std::size_t k = 0; k < seen.landmark[c].size(); ++k) {
        const auto at = world.landmark_of.find(seen.landmark[c][k]);
        if (at != world.landmark_of.end()) matches[c].push_back({KeypointIndex(k), at->second});
      }
    }
  }
  NewKeyframe make(map::MapDraft& draft) {
    return make_keyframe(seen.frame, matches, seen.T_world_rig.inverse(), pyramids, KeyframeId(0), {}, draft);
  }

  map::SimulatedMap world = true_map(simulator(synthetic::default_rig()), 0.0, 1.0);
  synthetic::SimulatedFrame seen = world.sim.frame(FrameId(1), 0.3);
  FrameMatches matches;
  std::vector<image::Pyramid> pyramids = map::flat_pyramids(4);
};

TEST_F(MakeKeyframe, KeypointsOfOneLandmarkBecomeOneFeature) {
  map::MapDraft draft = world.draft();
  const NewKeyframe made = make(draft);
  const map::BundledMap& map = draft.map();
  const frame::BundledFrame& stored = *map.keyframe(made.keyframe).frame;
  expect_consistent_table(stored);
  std::size_t joined = 0;
  for (std::size_t c = 0; c < matches.size(); ++c) {
    for (const Match& m : matches[c]) {
      const FeatureId f = stored.bundled.feature(CameraIndex(c), m.keypoint);
      EXPECT_EQ(map.landmark_of(made.keyframe, f), m.landmark);
      joined += stored.bundled.keypoints(f).size() > 1 &&
                !seen.frame.bundled.is_matched(seen.frame.bundled.feature(CameraIndex(c), m.keypoint));
    }
  }
  EXPECT_GT(joined, 20u);  // a fifth of the landmarks seen by two cameras was not matched between them before
  EXPECT_EQ(map.check_invariants(), std::nullopt);
}

TEST_F(MakeKeyframe, MatchedFeaturesWithAccurateDepthBecomeLandmarksAtTheirPoint) {
  map::MapDraft draft = world.draft();
  const std::size_t before = draft.map().landmark_slots();
  const NewKeyframe made = make(draft);
  const map::BundledMap& map = draft.map();
  const frame::BundledFrame& stored = *map.keyframe(made.keyframe).frame;
  std::size_t fresh = 0, near = 0;
  for (std::size_t i = before; i < map.landmark_slots(); ++i, ++fresh) {
    const LandmarkId l(i);
    ASSERT_EQ(map.observations(l).size(), 1u);
    const FeatureId f = map.observations(l)[0].feature;
    ASSERT_TRUE(stored.bundled.point(f).has_value());
    const KeypointRef first = stored.bundled.keypoints(f).front();
    EXPECT_EQ(map.landmark(l).reference.keyframe, made.keyframe);
    const int truth = seen.landmark[first.camera.index()][first.keypoint.index()];
    ASSERT_GE(truth, 0);
    const Eigen::Matrix3d& covariance = stored.bundled.point(f)->covariance;
    const Eigen::Vector3d error =
        seen.T_world_rig.inverse() * world.truth_of(truth) - stored.bundled.point(f)->point_rig;
    near += error.dot(covariance.ldlt().solve(error)) < 16.3;  // 99.9 %, three degrees of freedom
  }
  EXPECT_GT(fresh, 5u);
  EXPECT_GE(static_cast<double>(near), 0.97 * static_cast<double>(fresh));
}

TEST_F(MakeKeyframe, ListsEveryObservedLandmarkInOrder) {
  map::MapDraft draft = world.draft();
  const NewKeyframe made = make(draft);
  std::vector<LandmarkId> table;
  for (const LandmarkId l : draft.map().keyframe(made.keyframe).landmarks) {
    if (l.valid()) table.push_back(l);
  }
  std::sort(table.begin(), table.end());
  EXPECT_EQ(made.landmarks, table);
  EXPECT_EQ(std::adjacent_find(table.begin(), table.end()), table.end());
  EXPECT_EQ(draft.map().keyframe(made.keyframe).parent, KeyframeId(0));
}

TEST_F(MakeKeyframe, TwoLandmarksNeverShareAFeature) {
  // A feature whose two keypoints were matched to different landmarks is split.
  FeatureId torn;
  for (std::size_t f = 0; f < seen.frame.bundled.num_matched() && !torn.valid(); ++f) {
    if (world.landmark_of.contains(map::shown_by(seen, FeatureId(f)))) torn = FeatureId(f);
  }
  ASSERT_TRUE(torn.valid());
  const KeypointRef second = seen.frame.bundled.keypoints(torn)[1];
  std::set<LandmarkId> used;
  for (const auto& camera : matches) {
    for (const Match& m : camera) used.insert(m.landmark);
  }
  LandmarkId other;
  for (const LandmarkId l : world.map.landmark_ids()) {
    if (!used.contains(l)) other = l;
  }
  ASSERT_TRUE(other.valid());
  for (Match& m : matches[second.camera.index()]) {
    if (m.keypoint == second.keypoint) m.landmark = other;
  }
  map::MapDraft draft = world.draft();
  const NewKeyframe made = make(draft);
  const frame::BundledFrame& stored = *draft.map().keyframe(made.keyframe).frame;
  expect_consistent_table(stored);
  const KeypointRef first = seen.frame.bundled.keypoints(torn)[0];
  EXPECT_NE(stored.bundled.feature(first), stored.bundled.feature(second));
  EXPECT_EQ(draft.map().landmark_of(made.keyframe, stored.bundled.feature(second)), other);
  EXPECT_EQ(draft.map().check_invariants(), std::nullopt);
}

TEST_F(MakeKeyframe, CommitGivesTheSameMap) {
  map::MapStore store(world.map);
  map::MapDraft draft(store.snapshot());
  const NewKeyframe made = make(draft);
  const auto report = store.commit(std::move(draft));
  ASSERT_EQ(report.keyframes.size(), 1u);
  EXPECT_EQ(report.keyframes[0], made.keyframe);
  EXPECT_EQ(store.snapshot()->check_invariants(), std::nullopt);
  EXPECT_EQ(store.snapshot()->num_keyframes(), 2u);
}

TEST_F(MakeKeyframe, WorksWithAMissingCamera) {
  const std::vector<int> missing = {0};
  seen = world.sim.frame(FrameId(1), 0.3, missing);
  matches.clear();
  SetUp();
  map::MapDraft draft = world.draft();
  const NewKeyframe made = make(draft);
  expect_consistent_table(*draft.map().keyframe(made.keyframe).frame);
  EXPECT_EQ(draft.map().check_invariants(), std::nullopt);
}

}  // namespace
}  // namespace bslam::tracking
