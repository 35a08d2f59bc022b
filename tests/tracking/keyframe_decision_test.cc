#include "tracking/keyframe_decision.h"

#include <gtest/gtest.h>

#include "tracking/simulated_tracker.h"

namespace bslam::tracking {
namespace {

// A slowly moving rig with a large overlap with its reference: no keyframe is due.
KeyframeEvidence calm() {
  KeyframeEvidence e;
  e.frames_since_keyframe = 10;
  e.overlap = 95;
  e.best_overlap = 100;
  e.parallax = 0.03;
  return e;
}
const KeyframeOptions kOptions;

TEST(KeyframeDecision, NoKeyframeInSlowMotion) { EXPECT_FALSE(keyframe_due(calm(), kOptions)); }

TEST(KeyframeDecision, DueIfOverlapFallsBelowAFractionOfItsMaximum) {
  KeyframeEvidence e = calm();
  e.overlap = 76;
  EXPECT_FALSE(keyframe_due(e, kOptions));
  e.overlap = 74;
  EXPECT_TRUE(keyframe_due(e, kOptions));
  e.best_overlap = 80;
  EXPECT_FALSE(keyframe_due(e, kOptions));
}

TEST(KeyframeDecision, DueIfParallaxIsLarge) {
  KeyframeEvidence e = calm();
  e.parallax = kOptions.max_parallax + 0.001;
  EXPECT_TRUE(keyframe_due(e, kOptions));
}

TEST(KeyframeDecision, DueIfManyFeaturesWithDepthAreUntracked) {
  KeyframeEvidence e = calm();
  e.untracked_depth = true;
  EXPECT_TRUE(keyframe_due(e, kOptions));
}

// Leaves that move in the wind while the rig waits are untracked in every frame.
TEST(KeyframeDecision, NotDueAtRestAlthoughManyFeaturesWithDepthAreUntracked) {
  KeyframeEvidence e = calm();
  e.untracked_depth = true;
  e.parallax = 0.001;
  e.overlap = 99;
  EXPECT_FALSE(keyframe_due(e, kOptions));
  e.near_parallax = 0.02;  // on a drive among far landmarks
  EXPECT_TRUE(keyframe_due(e, kOptions));
  e.near_parallax = 0.001;
  e.overlap = 90;  // the view has changed
  EXPECT_TRUE(keyframe_due(e, kOptions));
}

TEST(KeyframeDecision, NeverDueWithinTheMinimumInterval) {
  KeyframeEvidence e;
  e.parallax = 1;
  e.untracked_depth = e.camera_with_few_inliers = true;
  e.best_overlap = 100;
  e.frames_since_keyframe = kOptions.min_interval - 1;
  EXPECT_FALSE(keyframe_due(e, kOptions));
  e.frames_since_keyframe = kOptions.min_interval;
  EXPECT_TRUE(keyframe_due(e, kOptions));
}

TEST(KeyframeDecision, DueAfterTheMaximumIntervalUnlessTheRigIsAtRest) {
  KeyframeEvidence e = calm();
  e.frames_since_keyframe = kOptions.max_interval - 1;
  EXPECT_FALSE(keyframe_due(e, kOptions));
  e.frames_since_keyframe = kOptions.max_interval;
  EXPECT_TRUE(keyframe_due(e, kOptions));
  e.parallax = 0.001;
  e.overlap = 99;
  EXPECT_FALSE(keyframe_due(e, kOptions));
}

TEST(KeyframeDecision, DuePeriodicallyIfACameraHasFewInliersUnlessTheRigIsAtRest) {
  KeyframeEvidence e = calm();
  e.camera_with_few_inliers = true;
  e.frames_since_keyframe = 4;
  EXPECT_FALSE(keyframe_due(e, kOptions));
  e.frames_since_keyframe = 8;
  EXPECT_TRUE(keyframe_due(e, kOptions));
  e.parallax = 0.001;
  e.overlap = 99;
  EXPECT_FALSE(keyframe_due(e, kOptions));
}

class KeyframeEvidenceTest : public ::testing::Test {
 protected:
  static const map::SimulatedMap& world() {
    static const map::SimulatedMap world = true_map(simulator(synthetic::default_rig()), 0.0, 1.0);
    return world;
  }
  // The true matches of the given cameras.
  static FrameMatches true_matches(const synthetic::SimulatedFrame& frame, const std::vector<int>& cameras) {
    FrameMatches matches(frame.frame.cameras.size());
    for (const int c : cameras) {
      const auto& shown = frame.landmark[static_cast<std::size_t>(c)];
      for (std::size_t k = 0; k < shown.size(); ++k) {
        const auto at = world().landmark_of.find(shown[k]);
        if (shown[k] >= 0 && at != world().landmark_of.end())
          matches[static_cast<std::size_t>(c)].push_back({KeypointIndex(k), at->second});
      }
    }
    return matches;
  }
};

TEST_F(KeyframeEvidenceTest, CountsEachLandmarkOfTheReferenceOnce) {
  const auto frame = world().sim.frame(FrameId(1), 0.1);
  const FrameMatches matches = true_matches(frame, {0, 1, 2, 3});
  const KeyframeEvidence e = keyframe_evidence(world().map, frame.frame, matches, KeyframeId(0),
                                               frame.T_world_rig.inverse(), TrackingOptions());
  EXPECT_EQ(e.overlap, static_cast<int>(landmarks_of(matches).size()));  // the map is one keyframe
  EXPECT_FALSE(e.camera_with_few_inliers);
  EXPECT_FALSE(e.untracked_depth);
}

TEST_F(KeyframeEvidenceTest, MeasuresParallaxAtTheLandmarks) {
  const auto frame = world().sim.frame(FrameId(1), 0.0);
  const FrameMatches matches = true_matches(frame, {0, 1, 2, 3});
  const geometry::SE3 here = world().true_pose(KeyframeId(0));
  EXPECT_NEAR(keyframe_evidence(world().map, frame.frame, matches, KeyframeId(0), here, TrackingOptions()).parallax,
              0.0, 1e-9);
  const geometry::SE3 rotated = geometry::SE3::exp((geometry::Vector6d() << 0.1, 0.2, 0, 0, 0, 0).finished()) * here;
  EXPECT_NEAR(keyframe_evidence(world().map, frame.frame, matches, KeyframeId(0), rotated, TrackingOptions()).parallax,
              0.0, 1e-9);
  const geometry::SE3 moved(here.rotation(), here.translation() + Eigen::Vector3d(0, 0.2, 0));
  const double parallax =
      keyframe_evidence(world().map, frame.frame, matches, KeyframeId(0), moved, TrackingOptions()).parallax;
  EXPECT_GT(parallax, 0.2 / 10);  // the room is ten metres long
  EXPECT_LT(parallax, 0.2 / 1.5);
}

TEST_F(KeyframeEvidenceTest, DetectsACameraWithoutInliers) {
  const auto frame = world().sim.frame(FrameId(1), 0.1);
  const geometry::SE3 pose = frame.T_world_rig.inverse();
  EXPECT_TRUE(keyframe_evidence(world().map, frame.frame, true_matches(frame, {0, 1, 2}), KeyframeId(0), pose,
                                TrackingOptions())
                  .camera_with_few_inliers);
  const std::vector<int> missing = {3};  // a camera without keypoints is ignored
  const auto three = world().sim.frame(FrameId(1), 0.1, missing);
  EXPECT_FALSE(keyframe_evidence(world().map, three.frame, true_matches(three, {0, 1, 2}), KeyframeId(0), pose,
                                 TrackingOptions())
                   .camera_with_few_inliers);
}

TEST_F(KeyframeEvidenceTest, DetectsUntrackedFeaturesWithDepth) {
  const auto frame = world().sim.frame(FrameId(1), 0.1);
  FrameMatches matches = true_matches(frame, {2, 3});  // the two front cameras, which overlap, have no matches
  const KeyframeEvidence e = keyframe_evidence(world().map, frame.frame, matches, KeyframeId(0),
                                               frame.T_world_rig.inverse(), TrackingOptions());
  EXPECT_TRUE(e.untracked_depth);
}

// The matches of all cameras with the landmarks of a keyframe.
FrameMatches all_matches_of(const map::BundledMap& map, KeyframeId k) {
  const map::BundledKeyframe& keyframe = map.keyframe(k);
  FrameMatches out(map.rig().size());
  for (std::size_t f = 0; f < keyframe.landmarks.size(); ++f) {
    if (!keyframe.landmarks[f].valid()) continue;
    for (const frame::KeypointRef r : keyframe.frame->bundled.keypoints(FeatureId(f)))
      out[r.camera.index()].push_back({r.keypoint, keyframe.landmarks[f]});
  }
  return out;
}

// Cameras 0 and 1 have an image in keyframe 8, the others in keyframe 4 only.
std::vector<CameraReference> two_references() {
  std::vector<CameraReference> out(4, {KeyframeId(8), 1});
  out[2] = out[3] = {KeyframeId(4), 5};
  return out;
}

TEST(KeyframeReferences, EachCameraIsComparedWithItsOwn) {
  const map::SimulatedMap world = true_map(simulator(synthetic::default_rig()), 4.0, 0.5);
  const map::BundledKeyframe& newest = world.map.keyframe(KeyframeId(8));
  FrameMatches matches = all_matches_of(world.map, KeyframeId(8)), then = all_matches_of(world.map, KeyframeId(4));
  for (const std::size_t c : {2, 3}) {  // landmarks that have left the view of all cameras
    std::erase_if(then[c], [&](const Match& m) {
      return std::ranges::count(world.map.observations(m.landmark), KeyframeId(8), &map::Observation::keyframe) > 0;
    });
    then[c].resize(std::min(then[c].size(), matches[c].size()));
    for (std::size_t i = 0; i < then[c].size(); ++i) then[c][i].keypoint = matches[c][i].keypoint;
    matches[c] = then[c];
  }
  std::vector<CameraReference> references = two_references();
  const auto evidence =
      evidence_by_reference(world.map, *newest.frame, matches, newest.T_rig_world, {}, true, references);
  ASSERT_EQ(evidence.size(), 2u);
  EXPECT_EQ(evidence[0].frames_since_keyframe, 1);
  EXPECT_NEAR(evidence[0].parallax, 0, 1e-9);
  EXPECT_EQ(evidence[0].overlap, evidence[0].best_overlap);
  EXPECT_EQ(evidence[0].best_overlap, references[0].best_direct_overlap + references[1].best_direct_overlap);
  EXPECT_EQ(evidence[1].frames_since_keyframe, 5);
  EXPECT_GT(evidence[1].parallax, 0.01);
}

TEST(KeyframeReferences, ACameraWhoseViewOthersShareIsComparedWithTheNewestForSomeKeyframes) {
  const map::SimulatedMap world = true_map(simulator(synthetic::default_rig()), 5.0, 0.5);
  const map::BundledKeyframe& newest = world.map.keyframe(KeyframeId(10));
  const FrameMatches matches = all_matches_of(world.map, KeyframeId(10));
  TrackingOptions options;
  options.consensus.min_expected = 0;
  for (const std::size_t former : {1, 2, 3, 9}) {
    std::vector<CameraReference> references(4, {KeyframeId(10), 1});
    references[1] = {KeyframeId(former), 9};
    const auto evidence =
        evidence_by_reference(world.map, *newest.frame, matches, newest.T_rig_world, options, true, references);
    EXPECT_EQ(evidence.size(), former <= 2 ? 2u : 1u) << "keyframe " << former;
  }
}

TEST(KeyframeReferences, TheFirstImageOfACameraMayAlreadyHaveLostMostOfThem) {
  const map::SimulatedMap world = true_map(simulator(synthetic::default_rig()), 4.0, 0.5);
  const map::BundledKeyframe& newest = world.map.keyframe(KeyframeId(8));
  const FrameMatches matches = all_matches_of(world.map, KeyframeId(8));
  const geometry::SE3 turned =
      geometry::SE3::exp((geometry::Vector6d() << 0, 0.9, 0, 0, 0, 0).finished()) * newest.T_rig_world;
  const auto lost = [&](const geometry::SE3& pose, bool late, bool direct) {
    std::vector<CameraReference> references(4, {.keyframe = KeyframeId(8), .frames = 5, .late = late});
    const auto e = evidence_by_reference(world.map, *newest.frame, matches, pose, {}, direct, references).at(0);
    return e.overlap < 0.8 * e.best_overlap;
  };
  for (const bool direct : {true, false}) {
    EXPECT_TRUE(lost(turned, true, direct));
    EXPECT_FALSE(lost(newest.T_rig_world, true, direct));
    EXPECT_FALSE(lost(turned, false, direct));
  }
}

// Without some of the cameras, fewer landmarks are found than all of them have found together.
TEST(KeyframeReferences, CamerasWithoutAnImageDoNotReduceTheOverlap) {
  const map::SimulatedMap world = true_map(simulator(synthetic::default_rig()), 4.0, 0.5);
  const map::BundledKeyframe& newest = world.map.keyframe(KeyframeId(8));
  frame::BundledFrame frame = *newest.frame;
  FrameMatches matches = all_matches_of(world.map, KeyframeId(8));
  for (const bool direct : {false, true}) {
    std::vector<CameraReference> references(4, {KeyframeId(8), 5});
    const auto overlap = [&](const frame::BundledFrame& of, const FrameMatches& found) {
      const auto e = evidence_by_reference(world.map, of, found, newest.T_rig_world, {}, direct, references).at(0);
      return static_cast<double>(e.overlap) / e.best_overlap;
    };
    frame::BundledFrame some = frame;
    FrameMatches found = matches;
    for (const std::size_t c : {2, 3}) {
      some.cameras[c].state = image::ImageState::kMissing;
      found[c].clear();
    }
    EXPECT_EQ(overlap(frame, matches), 1.0);
    EXPECT_EQ(overlap(some, found), 1.0);
    EXPECT_EQ(overlap(frame, matches), 1.0);
    found[0].resize(found[0].size() / 2);
    found[1].resize(found[1].size() / 2);
    EXPECT_NEAR(overlap(some, found), 0.5, 0.02);
  }
}

TEST(KeyframeReferences, ACameraThatSeesNextToNothingAsksForNoKeyframe) {
  const map::SimulatedMap world = true_map(simulator(synthetic::default_rig()), 4.0, 0.5);
  const map::BundledKeyframe& newest = world.map.keyframe(KeyframeId(8));
  FrameMatches matches = all_matches_of(world.map, KeyframeId(8));
  matches[2].clear();
  matches[3].clear();
  std::vector<CameraReference> references = two_references();
  EXPECT_EQ(evidence_by_reference(world.map, *newest.frame, matches, newest.T_rig_world, {}, true, references).size(),
            1u);
}

TEST(KeyframeReferences, AKeyframeIsThatOfTheCamerasInIt) {
  const map::SimulatedMap world = true_map(simulator(synthetic::default_rig()), 4.0, 0.5);
  frame::BundledFrame frame = *world.map.keyframe(KeyframeId(8)).frame;
  frame.cameras[3].state = image::ImageState::kMissing;
  std::vector<CameraReference> references;
  refer_to(KeyframeId(5), frame, references);
  for (const CameraReference& r : references) EXPECT_EQ(r.keyframe, KeyframeId(5));
  references[3].best_overlap = 70;
  refer_to(KeyframeId(8), frame, references);
  for (std::size_t c = 0; c < 3; ++c) EXPECT_EQ(references[c].keyframe, KeyframeId(8));
  EXPECT_EQ(references[3].keyframe, KeyframeId(5));
  EXPECT_EQ(references[3].best_overlap, 70);
}

// Matches of camera 0 with all landmarks of a keyframe.
FrameMatches matches_of(const map::BundledMap& map, KeyframeId k) {
  FrameMatches out(map.rig().size());
  for (const LandmarkId l : map.keyframe(k).landmarks) {
    if (l.valid()) out[0].push_back({KeypointIndex(out[0].size()), l});
  }
  return out;
}

TEST(SimilarKeyframe, IsFoundWhereTheRigIsBackAtAnOldKeyframe) {
  const map::SimulatedMap world = true_map(simulator(synthetic::default_rig()), 4.0, 0.5);
  const KeyframeId newest = world.map.newest_keyframe(), old(1);
  ASSERT_EQ(newest.index(), 8u);
  const frame::BundledFrame& frame = *world.map.keyframe(old).frame;
  const FrameMatches matches = matches_of(world.map, old);
  const geometry::SE3 here = world.map.keyframe(old).T_rig_world;
  EXPECT_EQ(similar_keyframe(world.map, frame, matches, newest, here, kOptions), old);
  EXPECT_NE(similar_keyframe(world.map, frame, matches, old, here, kOptions), old);  // it is the reference already
  const geometry::SE3 away(here.rotation(), here.translation() + Eigen::Vector3d(0, 0, 3));
  EXPECT_FALSE(similar_keyframe(world.map, frame, matches, newest, away, kOptions));
  FrameMatches few = matches;
  few[0].resize(50);
  EXPECT_FALSE(similar_keyframe(world.map, frame, few, newest, here, kOptions));
  frame::BundledFrame dark = frame;  // the camera that saw most of the landmarks has no image
  for (frame::CameraFrame& camera : dark.cameras) camera.state = image::ImageState::kMissing;
  EXPECT_FALSE(similar_keyframe(world.map, dark, matches, newest, here, kOptions));
}

TEST(SimilarKeyframe, IsNotOneThatTheRigHasNotLeft) {
  const map::SimulatedMap world = true_map(simulator(synthetic::default_rig()), 4.0, 0.5);
  const KeyframeId recent(7);
  const frame::BundledFrame& frame = *world.map.keyframe(recent).frame;
  EXPECT_NE(similar_keyframe(world.map, frame, matches_of(world.map, recent), world.map.newest_keyframe(),
                             world.map.keyframe(recent).T_rig_world, kOptions),
            recent);
}

}  // namespace
}  // namespace bslam::tracking
