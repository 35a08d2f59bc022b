// Correction of a map with drift after a place was recognised.
#include "looping/loop_correction.h"

#include <gtest/gtest.h>

#include <set>

#include "looping/relative_scale.h"
#include "map/anchored_pose.h"
#include "map/synthetic_map.h"
#include "simulated_hall.h"

namespace bslam::looping {
namespace {

using Eigen::Vector3d;
using map::Fingerprint;

constexpr KeyframeId kLast(kLapKeyframes + 1);

std::optional<PlaceMatch> locate_last(const HallMap& world) {
  return verify_place(world.map, world.map.rig_of(kLast), *world.map.keyframe(kLast).frame, KeyframeId(1), {},
                      kFeatures, seeded(1));
}

// Position error of a keyframe in metres, and the mean position error of its landmarks.
double error_of(const HallMap& world, const map::BundledMap& map, KeyframeId k) {
  return distance_m(map.keyframe(k).T_rig_world, world.truth(k));
}
double landmark_error(const HallMap& world, const map::BundledMap& map, KeyframeId k) {
  double sum = 0;
  int count = 0;
  for (const LandmarkId l : map.keyframe(k).landmarks) {
    if (!l.valid()) continue;
    sum += (map.landmark(l).position - world.truth(l)).norm();
    ++count;
  }
  return sum / count;
}
double mean_error(const HallMap& world, const map::BundledMap& map) {
  double sum = 0;
  for (const KeyframeId k : map.keyframe_ids()) sum += error_of(world, map, k);
  return sum / static_cast<double>(map.num_keyframes());
}

int weight_between(const map::BundledMap& map, KeyframeId a, KeyframeId b) {
  const std::vector<map::Covisible>& list = map.keyframe(a).covisible;
  const auto at = std::ranges::lower_bound(list, b, {}, &map::Covisible::keyframe);
  return at != list.end() && at->keyframe == b ? at->weight : 0;
}

// Viewing directions and distance ranges match the present positions.
void expect_refreshed(const map::BundledMap& map) {
  map::BundledMap again = map;
  int stale = 0;
  for (const LandmarkId l : map.landmark_ids()) {
    again.refresh_landmark(l);
    const map::Landmark &ours = map.landmark(l), &refreshed = again.landmark(l);
    stale += (ours.view_direction - refreshed.view_direction).norm() > 1e-6 ||
             std::abs(ours.max_distance / refreshed.max_distance - 1) > 1e-5;
  }
  EXPECT_EQ(stale, 0) << "of " << map.num_landmarks();
}

class CloseLoopRig : public ::testing::TestWithParam<int> {
 protected:
  CloseLoopRig() : world(map_with_drift(GetParam())), place_match(locate_last(world)), draft(world.draft()) {}
  void SetUp() override {
    ASSERT_TRUE(place_match);
    closure = measure(world.map, kLast, *place_match);
    close_loop(closure, *place_match, {}, kFeatures, draft);
  }

  const HallMap& world;
  const std::optional<PlaceMatch> place_match;
  map::MapDraft draft;
  LoopClosure closure;
};

TEST_P(CloseLoopRig, MeasuresTheDrift) {
  EXPECT_EQ(closure.keyframe, kLast);
  EXPECT_EQ(closure.matched_keyframe, KeyframeId(1));
  EXPECT_NEAR(closure.translation_correction, error_of(world, world.map, kLast), 0.05);
  EXPECT_NEAR(closure.rotation_correction, angle_rad(world.map.keyframe(kLast).T_rig_world, world.truth(kLast)),
              0.1 * kDegree);
  EXPECT_EQ(closure.scale_correction, 1.0);
  EXPECT_FALSE(closure.merged);
  EXPECT_GT(closure.inliers, 100);
  EXPECT_TRUE(plausible(world.map, closure, {}));
  LoopOptions strict;
  strict.max_drift = 0.001;
  EXPECT_FALSE(plausible(world.map, closure, strict));
}

// A look-alike place, to which the drift of a lap may lead, but not that since the loop was closed.
TEST_P(CloseLoopRig, OnceClosedALargeCorrectionIsAFalseMatch) {
  double lap_m = 0;
  for (int k = 1; k <= kLast.value(); ++k)
    lap_m += distance_m(world.truth(KeyframeId(k)), world.truth(KeyframeId(k - 1)));
  LoopClosure far{.keyframe = kLast, .matched_keyframe = KeyframeId(1)};
  far.translation_correction = 0.8 * LoopOptions().max_drift * lap_m;
  EXPECT_TRUE(plausible(world.map, far, {}));
  EXPECT_FALSE(plausible(draft.map(), far, {})) << lap_m;
}

TEST_P(CloseLoopRig, ReducesThePoseErrors) {
  for (const KeyframeId k : {kLast, KeyframeId(kLast.value() - 1), KeyframeId(kLast.value() - 4)}) {
    EXPECT_LT(5 * error_of(world, draft.map(), k), error_of(world, world.map, k));
    EXPECT_LT(5 * angle_rad(draft.map().keyframe(k).T_rig_world, world.truth(k)),
              angle_rad(world.map.keyframe(k).T_rig_world, world.truth(k)));
  }
  // the graph has constraints at both ends only
  EXPECT_LT(2 * mean_error(world, draft.map()), mean_error(world, world.map));
  EXPECT_EQ(error_of(world, draft.map(), KeyframeId(0)), error_of(world, world.map, KeyframeId(0)));
}

TEST_P(CloseLoopRig, LandmarksMoveWithTheirKeyframes) {
  EXPECT_LT(5 * landmark_error(world, draft.map(), kLast), landmark_error(world, world.map, kLast));
  int checked = 0;
  for (const LandmarkId l : draft.map().landmark_ids()) {
    const map::LandmarkReference& before = world.map.landmark(l).reference;
    if (draft.map().landmark(l).reference.keyframe != before.keyframe) continue;
    const Vector3d in_rig = world.map.keyframe(before.keyframe).T_rig_world * world.map.landmark(l).position;
    const Vector3d now = draft.map().keyframe(before.keyframe).T_rig_world * draft.map().landmark(l).position;
    ASSERT_LT((in_rig - now).norm(), 1e-9);
    ++checked;
  }
  EXPECT_GT(checked, 1000);
  expect_refreshed(draft.map());
}

TEST_P(CloseLoopRig, FusesLandmarksObservedAtBothEnds) {
  const map::BundledMap& after = draft.map();
  EXPECT_EQ(weight_between(world.map, kLast, KeyframeId(1)), 0);
  EXPECT_GT(weight_between(after, kLast, KeyframeId(1)), 60);
  int merged = 0, wrong = 0;
  for (const LandmarkId l : world.map.landmark_ids()) {
    if (after.alive(l) || !after.resolve(l).valid()) continue;
    ++merged;
    wrong += world.shown_by_landmark[l.index()] != world.shown_by_landmark[after.resolve(l).index()];
    EXPECT_LT(after.resolve(l), l);  // the landmarks of the place are kept
  }
  EXPECT_GT(merged, 100);
  EXPECT_LE(wrong, merged / 100);

  // Few landmarks in view of the last keyframe and the place are still duplicated.
  std::set<HallMap::Shown> then;
  for (const LandmarkId l : landmarks_around(after, KeyframeId(1), 3, 100000))
    then.insert(world.shown_by_landmark[l.index()]);
  int known = 0, twice = 0;
  for (const LandmarkId l : after.keyframe(kLast).landmarks) {
    if (!l.valid() || !then.contains(world.shown_by_landmark[l.index()])) continue;
    ++known;
    twice += world.map.landmark(l).born > KeyframeId(kLapKeyframes / 2);
  }
  EXPECT_LT(twice, known / 10) << "of " << known;
}

TEST_P(CloseLoopRig, LeavesAValidMap) {
  EXPECT_EQ(draft.map().check_invariants(), std::nullopt);
  EXPECT_EQ(draft.map().gauge_epoch(), world.map.gauge_epoch() + 1);
  EXPECT_EQ(draft.map().num_keyframes(), world.map.num_keyframes());
}

TEST_P(CloseLoopRig, IsDeterministic) {
  map::MapDraft again = world.draft();
  close_loop(closure, *place_match, {}, kFeatures, again);
  EXPECT_TRUE(Fingerprint(draft.map()) == Fingerprint(again.map()));
}

INSTANTIATE_TEST_SUITE_P(Cameras, CloseLoopRig, ::testing::Values(1, 2, 4));

// A keyframe committed while the loop is closed moves with the correction, and so do its landmarks.
TEST(CloseLoop, IsRebasedOntoAKeyframeCommittedMeanwhile) {
  const FeatureSimulator simulator = hall(rig_of(2));
  HallMap world = map_with_drift(2);
  const auto place_match = locate_last(world);
  ASSERT_TRUE(place_match);
  map::MapStore store(world.map);
  map::MapDraft loop(store.snapshot());
  close_loop(measure(loop.map(), kLast, *place_match), *place_match, {}, kFeatures, loop);

  map::MapDraft tracking(store.snapshot());
  // added at its predicted pose
  const KeyframeId newer =
      world.add(simulator.frame(FrameId(kLapKeyframes + 2), kStepS * (kLapKeyframes + 2)), rigid_drift());
  std::vector<std::pair<FeatureId, LandmarkId>> matches;
  std::vector<std::pair<FeatureId, LandmarkId>> own;
  for (std::size_t f = 0; f < world.map.keyframe(newer).landmarks.size(); ++f) {
    const LandmarkId l = world.map.landmark_of(newer, FeatureId(f));
    if (l.valid()) (tracking.map().alive(l) ? matches : own).emplace_back(f, l);
  }
  ASSERT_GT(matches.size(), 50u);
  ASSERT_GT(own.size(), 10u);
  tracking.add_keyframe(world.map.keyframe(newer).frame, world.map.keyframe(newer).T_rig_world, matches, kLast);
  for (const auto& [feature, l] : own) tracking.add_landmark(world.map.landmark(l).position, {{newer, feature}});
  const SE3 T_newer_last = world.map.keyframe(newer).T_rig_world * world.map.keyframe(kLast).T_rig_world.inverse();

  EXPECT_FALSE(store.commit(std::move(tracking)).rebased);
  const map::CommitReport report = store.commit(std::move(loop));
  EXPECT_TRUE(report.rebased);
  const map::BundledMap& after = *report.published;
  EXPECT_EQ(after.check_invariants(), std::nullopt);
  EXPECT_EQ(after.gauge_epoch(), world.map.gauge_epoch() + 1);
  EXPECT_LT(distance_m(after.keyframe(newer).T_rig_world * after.keyframe(kLast).T_rig_world.inverse(), T_newer_last),
            1e-9);
  for (const KeyframeId k : {kLast, newer}) {
    EXPECT_LT(5 * error_of(world, after, k), error_of(world, world.map, k));
    EXPECT_LT(5 * landmark_error(world, after, k), landmark_error(world, world.map, k));
  }
  EXPECT_GT(weight_between(after, newer, KeyframeId(1)), 30);  // its matches were forwarded along the merges
}

// The scale is not observable with a single camera: at the end the map is too small by 10 %.
class ScaleDrift : public ::testing::Test {
 protected:
  static const HallMap& world() {
    static const HallMap map = simulate_lap(hall(rig_of(1)), 2, scale_drift());
    return map;
  }
  // Ratio of the lengths of the last steps in the map to their true lengths.
  static double step_ratio(const map::BundledMap& map) {
    const KeyframeId a(kLast.value() - 4);
    return distance_m(map.keyframe(a).T_rig_world, map.keyframe(kLast).T_rig_world) /
           distance_m(world().truth(a), world().truth(kLast));
  }
};

TEST_F(ScaleDrift, IsMeasuredAndRemoved) {
  auto place_match = locate_last(world());
  ASSERT_TRUE(place_match);
  const auto scale = relative_scale(world().map, kLast, *place_match);
  ASSERT_TRUE(scale);
  place_match->scale = *scale;
  const LoopClosure closure = measure(world().map, kLast, *place_match);
  EXPECT_NEAR(closure.scale_correction, 1 / 0.9, 0.02);
  EXPECT_TRUE(plausible(world().map, closure, {}));
  map::MapDraft draft = world().draft();
  close_loop(closure, *place_match, {}, kFeatures, draft);
  EXPECT_EQ(draft.map().check_invariants(), std::nullopt);
  EXPECT_NEAR(step_ratio(world().map), 0.9, 0.02);
  EXPECT_NEAR(step_ratio(draft.map()), 1.0, 0.02);
  EXPECT_LT(5 * error_of(world(), draft.map(), kLast), error_of(world(), world().map, kLast));
  EXPECT_LT(5 * landmark_error(world(), draft.map(), kLast), landmark_error(world(), world().map, kLast));
  EXPECT_LT(2 * mean_error(world(), draft.map()), mean_error(world(), world().map));
  expect_refreshed(draft.map());
}

// Poses of frames between keyframes are stored relative to a keyframe; their lengths follow its change of scale.
TEST_F(ScaleDrift, FramesFollowTheScaleOfTheirKeyframe) {
  auto place_match = locate_last(world());
  ASSERT_TRUE(place_match);
  place_match->scale = relative_scale(world().map, kLast, *place_match).value();
  const map::BundledMap& before = world().map;
  const KeyframeId previous(kLast.value() - 1);
  const auto anchored = map::AnchoredPose::at(before, previous, before.keyframe(kLast).T_rig_world);
  map::MapDraft draft = world().draft();
  ASSERT_TRUE(close_loop(measure(before, kLast, *place_match), *place_match, {}, kFeatures, draft));
  const auto resolved = anchored.resolve(draft.map());
  ASSERT_TRUE(resolved);
  const double step_before = distance_m(before.keyframe(previous).T_rig_world, before.keyframe(kLast).T_rig_world);
  const double step_after = distance_m(draft.map().keyframe(previous).T_rig_world, *resolved);
  EXPECT_NEAR(step_after / step_before, 1 / 0.9, 0.02);
}

// Two paths along the same wall; before the second one tracking restarted at another pose.
class MergeSubmaps : public ::testing::TestWithParam<int> {
 protected:
  // `log_scale`: of the younger submap.
  explicit MergeSubmaps(double log_scale = 0) : world(rig_of(GetParam())) {
    const FeatureSimulator simulator = hall(rig_of(GetParam()));
    for (int i = 0; i < 8; ++i) world.add(simulator.frame(FrameId(i), kStepS * i));
    const Sim3 elsewhere(Sim3::exp((geometry::Vector7d() << 0.2, -0.3, 1.9, 5, -7, 2, log_scale).finished()));
    for (int i = 8; i < 18; ++i)
      world.add(simulator.frame(FrameId(i), kStepS * (i - 4) + 0.5), elsewhere, 0, {}, i == 8);
    for (const KeyframeId k : world.map.keyframe_ids()) world.map.set_uncertainty(k, {kInside});
  }
  std::optional<PlaceMatch> located(int keyframe, int with) const {
    return verify_place(world.map, world.map.rig_of(KeyframeId(keyframe)),
                        *world.map.keyframe(KeyframeId(keyframe)).frame, KeyframeId(with), {}, kFeatures, seeded(1));
  }
  void expect_joined(int keyframe, int with) {
    const auto place_match = located(keyframe, with);
    ASSERT_TRUE(place_match);
    const LoopClosure closure = measure(world.map, KeyframeId(keyframe), *place_match);
    EXPECT_TRUE(closure.merged);
    EXPECT_TRUE(plausible(world.map, closure, {}));
    map::MapDraft draft = world.draft();
    merge_submaps(closure, *place_match, {}, kFeatures, draft);
    const map::BundledMap& after = draft.map();
    EXPECT_EQ(after.check_invariants(), std::nullopt);
    EXPECT_EQ(after.roots(), std::vector{KeyframeId(0)});
    EXPECT_EQ(after.gauge_epoch(), world.map.gauge_epoch() + 1);
    const auto [older, younger] = std::minmax(keyframe, with);
    const geometry::Matrix6d joint = after.keyframe(KeyframeId(younger)).uncertainty.noise;
    const geometry::Matrix6d A =
        (after.keyframe(KeyframeId(younger)).T_rig_world * after.keyframe(KeyframeId(older)).T_rig_world.inverse())
            .adjoint();
    EXPECT_LT((joint - 2 * kInside - A * kInside * A.transpose()).norm(), 1e-9 * joint.norm());
    for (const KeyframeId k : after.keyframe_ids()) {
      if (k < KeyframeId(8)) {
        EXPECT_EQ(after.keyframe(k).uncertainty.noise, kInside);
        EXPECT_EQ(after.keyframe(k).T_rig_world.translation(), world.map.keyframe(k).T_rig_world.translation());
      }
      EXPECT_LT(error_of(world, after, k), 0.02);
      EXPECT_LT(angle_rad(after.keyframe(k).T_rig_world, world.truth(k)), 0.15 * kDegree);
      EXPECT_LT(landmark_error(world, after, k), 0.03);
    }
    EXPECT_GT(weight_between(after, KeyframeId(keyframe), KeyframeId(with)), 60);
    expect_refreshed(after);
  }

  // Of every keyframe relative to the root of its submap.
  const geometry::Matrix6d kInside = 1e-4 * geometry::Matrix6d::Identity();
  HallMap world;
};

TEST_P(MergeSubmaps, MovesTheYoungerSubmapToTheOlder) { expect_joined(10, 6); }
TEST_P(MergeSubmaps, MovesTheYoungerSubmapIfTheOlderOneRecognisesIt) { expect_joined(6, 10); }

// The younger submap has 0.6 times the scale of the older one.
class MergeSubmapsUpToScale : public MergeSubmaps {
 protected:
  MergeSubmapsUpToScale() : MergeSubmaps(std::log(0.6)) { world.map.set_scale(map::Scale::kUpToScale); }
  void expect_joined_and_scaled(int keyframe, int with) {
    auto place_match = located(keyframe, with);
    ASSERT_TRUE(place_match);
    const auto scale = relative_scale(world.map, KeyframeId(keyframe), *place_match);
    ASSERT_TRUE(scale);
    const double expected = keyframe < with ? 0.6 : 1 / 0.6, tolerance = 0.02;
    EXPECT_NEAR(*scale, expected, tolerance);
    place_match->scale = *scale;
    const LoopClosure closure = measure(world.map, KeyframeId(keyframe), *place_match);
    ASSERT_TRUE(closure.merged && plausible(world.map, closure, {}));
    map::MapDraft draft = world.draft();
    merge_submaps(closure, *place_match, {}, kFeatures, draft);
    const map::BundledMap& after = draft.map();
    EXPECT_EQ(after.check_invariants(), std::nullopt);
    EXPECT_EQ(after.roots(), std::vector{KeyframeId(0)});
    for (const KeyframeId k : after.keyframe_ids()) {
      // An error of the scale displaces all that is away from the landmarks of both submaps, some 3 m ahead.
      const double from_joint_m = 3 + distance_m(world.truth(k), world.truth(KeyframeId(keyframe)));
      EXPECT_LT(error_of(world, after, k), 0.02 + tolerance / expected * from_joint_m);
      EXPECT_LT(angle_rad(after.keyframe(k).T_rig_world, world.truth(k)), 0.15 * kDegree);
      EXPECT_LT(landmark_error(world, after, k), 0.08);
    }
    expect_refreshed(after);
  }
};

TEST_P(MergeSubmapsUpToScale, ScalesTheYoungerSubmap) { expect_joined_and_scaled(10, 6); }
TEST_P(MergeSubmapsUpToScale, ScalesTheYoungerSubmapIfTheOlderOneRecognisesIt) { expect_joined_and_scaled(6, 10); }

INSTANTIATE_TEST_SUITE_P(Cameras, MergeSubmaps, ::testing::Values(1, 2, 4));
INSTANTIATE_TEST_SUITE_P(Cameras, MergeSubmapsUpToScale, ::testing::Values(1, 2));

}  // namespace
}  // namespace bslam::looping
