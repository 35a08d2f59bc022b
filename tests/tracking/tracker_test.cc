#include "tracking/tracker.h"

#include <gtest/gtest.h>

#include "tracking/tracker_run.h"

namespace bslam::tracking {
namespace {

using geometry::SE3;

TEST(Tracker, InitialisesAMetricMapAndTracksTheRig) {
  TrackerRun run(synthetic::ring_rig(2));
  int keyframes = 0;
  for (int i = 0; i < 12; ++i) {
    const FrameRecord record = run.process(run.frame(i));
    ASSERT_EQ(record.result.status, TrackStatus::kTracking) << "frame " << i << ": " << describe(record.result.reason);
    EXPECT_LT(map::distance_m(record.result.T_rig_world, relative(run.sim, 0, i)), 0.03) << "frame " << i;
    EXPECT_EQ(record.twist.has_value(), i > 0) << "frame " << i;
    EXPECT_EQ(record.result.covariance.has_value(), i > 0) << "frame " << i;
    EXPECT_EQ(record.unique, record.monocular + record.matched);
    EXPECT_EQ(record.root, KeyframeId(0));
    keyframes += record.keyframe;
  }
  EXPECT_EQ(run.store.snapshot()->num_keyframes(), static_cast<std::size_t>(keyframes));
  EXPECT_EQ(run.store.snapshot()->check_invariants(), std::nullopt);
}

TEST(Tracker, DirectTrackingPausesAfterFailures) {
  for (const auto& [front_end, expected] :
       {std::pair{FrontEnd::kFeatures, "................"}, std::pair{FrontEnd::kDirect, "xxxxxxxxxxxxxxxx"},
        std::pair{FrontEnd::kAuto, "xxx..........x.."}}) {
    TrackerOptions options;
    options.tracking.frontend = front_end;
    TrackerRun run(synthetic::ring_rig(2), options);
    run.process(run.frame(0));
    EXPECT_FALSE(run.tracker.tracks_directly(run.state));  // the motion is not known
    run.process(run.frame(1));
    std::string attempts;
    for (int i = 2; i < 18; ++i) {
      attempts += run.tracker.tracks_directly(run.state) ? 'x' : '.';
      run.process(run.frame(i), {attempts.back() == 'x' ? DirectFailure::kNoPose : DirectFailure::kNotTried});
    }
    EXPECT_EQ(attempts, expected);
    run.state.direct_pause = 0;
    run.state.track.cameras[1].excluded = true;
    EXPECT_FALSE(run.tracker.tracks_directly(run.state));
  }
}

TEST(Tracker, AKeyframeThatIsDueIsInsertedWithFeatures) {
  TrackerRun run(synthetic::ring_rig(2));
  for (int i = 0; i < 3; ++i) run.process(run.frame(i));
  EXPECT_FALSE(run.propose(run.frame(3)).edit);
  const TrackOutcome outcome = run.propose(run.frame(3), {DirectFailure::kKeyframeDue});
  ASSERT_TRUE(outcome.edit);
  EXPECT_EQ(outcome.edit->kind, ProposedEdit::Kind::kKeyframe);
}

// Keyframes as often as possible, in every second frame, must not always miss the images of the same cameras.
TEST(Tracker, CamerasWithFewerImagesHaveKeyframes) {
  for (const int parity : {0, 1}) {
    TrackerRun run(synthetic::default_rig());
    int keyframes = 0, with_all = 0;
    for (int i = 0; i < 24; ++i) {
      const std::vector<int> missing = i > 0 && i % 2 == parity ? std::vector{2, 3} : std::vector<int>();
      const FrameRecord record = run.process(run.sim.frame(FrameId(i), 0.12 * i, missing).frame);
      ASSERT_EQ(record.result.status, TrackStatus::kTracking) << "frame " << i;
      keyframes += record.keyframe;
      with_all += record.keyframe && missing.empty();
    }
    EXPECT_GT(with_all, keyframes / 3) << "parity " << parity;
  }
}

// Tracks a frame as if directly, and requests a keyframe of it, which is created and committed but not adopted.
KeyframeId defer_keyframe(TrackerRun& run, int i) {
  const map::MapSnapshot map = run.store.snapshot();
  const FrontEndState before = run.state;
  const FrameRecord record = run.process(run.frame(i));
  EXPECT_FALSE(record.keyframe);
  run.state.pending = {FrameId(i), record.result.anchored, map->keyframe_slots(), run.state.planned_ns};
  auto created = run.tracker.create_keyframe({run.frame(i), before, record.result.anchored}, run.pyramids, map);
  return run.store.commit(std::move(created->edit->draft)).keyframes.front();
}

TEST(Tracker, ContinuesFromAKeyframeThatWasCreatedLater) {
  for (const int later : {0, 2}) {
    TrackerOptions options;
    options.tracking.keyframe.min_interval = 100;  // none is made of the frames since
    TrackerRun run(synthetic::ring_rig(2), options);
    for (int i = 0; i < 3; ++i) run.process(run.frame(i));
    const KeyframeId k = defer_keyframe(run, 3);
    for (int i = 4; i < 4 + later; ++i) {
      EXPECT_EQ(run.tracker.adopt_keyframe(map::BundledMap(run.store.snapshot()->shared_rig()), run.state),
                std::nullopt);
      run.process(run.frame(i));
    }
    const map::MapSnapshot map = run.store.snapshot();
    const SE3 before = *run.state.track.anchored.resolve(*map);
    const auto created = run.tracker.adopt_keyframe(*map, run.state);
    ASSERT_TRUE(created);
    EXPECT_EQ(created->frame, FrameId(3));
    EXPECT_EQ(created->keyframe, k);
    EXPECT_EQ(run.state.track.anchored.reference, k);
    EXPECT_LT(map::distance_m(*run.state.track.anchored.resolve(*map), before), 0.01);
    for (const CameraReference& r : run.state.track.references) EXPECT_EQ(r.frames, later);
    EXPECT_FALSE(run.state.pending);
    EXPECT_EQ(run.process(run.frame(4 + later)).result.status, TrackStatus::kTracking);
  }
}

TEST(Tracker, WaitsForAKeyframeForSomeFramesAndForSomeTime) {
  TrackerRun run(synthetic::ring_rig(2));
  for (int i = 0; i < 3; ++i) run.process(run.frame(i));
  const FrontEndState before = run.state;
  for (const auto& [interval_s, expected] : {std::pair{0.1, kMaxPendingFrames + 1}, std::pair{0.0101, 30}}) {
    run.state = before;
    run.state.pending = {FrameId(2), run.state.track.anchored, run.store.snapshot()->keyframe_slots(),
                         run.state.planned_ns};
    int waited = 0;
    for (; run.state.pending && waited < 100; ++waited) {
      run.state.planned_ns += from_seconds(interval_s);
      run.tracker.adopt_keyframe(*run.store.snapshot(), run.state);
    }
    EXPECT_EQ(waited, expected) << interval_s;
    EXPECT_TRUE(run.state.keyframe_failed);
  }
  run.state.planned_ns = before.planned_ns;
  run.process(run.frame(3));
  EXPECT_FALSE(run.state.keyframe_failed);
}

TEST(Tracker, AFrameWithoutAPoseForgetsThePendingKeyframe) {
  TrackerRun run(synthetic::ring_rig(2));
  for (int i = 0; i < 4; ++i) run.process(run.frame(i));
  run.state.pending = {FrameId(3), run.state.track.anchored, run.store.snapshot()->keyframe_slots(),
                       run.state.planned_ns};
  run.process(elsewhere(run.frame(4)));
  EXPECT_FALSE(run.state.pending);
}

// A video with repeated images has a frame without any after each one.
TEST(Tracker, AFrameWithoutImagesKeepsThePendingKeyframe) {
  TrackerRun run(synthetic::ring_rig(2));
  for (int i = 0; i < 4; ++i) run.process(run.frame(i));
  run.state.pending = {FrameId(3), run.state.track.anchored, run.store.snapshot()->keyframe_slots(),
                       run.state.planned_ns};
  const std::vector<int> missing = {0, 1};
  const FrameRecord record = run.process(run.sim.frame(FrameId(4), TrackerRun::time_s(4), missing).frame);
  EXPECT_EQ(record.result.reason, LostReason::kNoImages);
  EXPECT_TRUE(run.state.pending);
}

TEST(Tracker, KeepsThePoseFoundDirectlyIfTheFeaturesOfTheFrameGiveNone) {
  TrackerRun run(synthetic::ring_rig(2));
  for (int i = 0; i < 4; ++i) run.process(run.frame(i));
  TrackOutcome direct = run.propose(run.frame(4));
  direct.edit.reset();
  const TrackOutcome outcome = run.propose(elsewhere(run.frame(4)), {DirectFailure::kFewInliers, direct});
  EXPECT_EQ(outcome.record.result.status, TrackStatus::kTracking);
  EXPECT_EQ(map::distance_m(outcome.record.result.T_rig_world, direct.record.result.T_rig_world), 0);
  EXPECT_EQ(outcome.next.track.time_ns, direct.next.track.time_ns);
  EXPECT_EQ(outcome.next.frames_lost, 0);
  EXPECT_FALSE(outcome.edit);
  run.state.direct_kept = 5;  // as often before
  const TrackOutcome contradicted = run.propose(elsewhere(run.frame(4)), {DirectFailure::kFewInliers, direct});
  EXPECT_EQ(contradicted.record.result.status, TrackStatus::kLost);
  EXPECT_EQ(run.process(run.frame(4)).result.status, TrackStatus::kTracking);
  EXPECT_EQ(run.state.direct_kept, 0);
}

TEST(Tracker, OutcomeDependsOnlyOnTheArguments) {
  TrackerRun run(synthetic::ring_rig(2));
  for (int i = 0; i < 4; ++i) run.process(run.frame(i));
  const TrackOutcome once = run.propose(run.frame(4)), other = run.propose(elsewhere(run.frame(5))),
                     again = run.propose(run.frame(4));
  EXPECT_EQ(other.record.result.status, TrackStatus::kLost);
  EXPECT_EQ(once.record.result.T_rig_world.translation(), again.record.result.T_rig_world.translation());
  EXPECT_EQ(once.record.result.covariance, again.record.result.covariance);
  EXPECT_EQ(once.next.track.landmarks, again.next.track.landmarks);
  EXPECT_EQ(once.next.budget_fractions, again.next.budget_fractions);
}

TEST(Tracker, CovarianceMatchesTheErrors) {
  const map::SimulatedMap world = true_map(simulator(synthetic::default_rig(), room(1, 0.7, 0.1)), 1.0, 0.25);
  SimulatedTracker tracker(world);
  constexpr int kFrames = 60;
  double normalised = 0;
  for (int i = 1; i <= kFrames; ++i) {
    const auto seen = world.sim.frame(FrameId(i), 0.05 * i);
    const TrackResult result = tracker.track(seen.frame).result;
    ASSERT_TRUE(result.covariance);
    EXPECT_EQ(*result.covariance, result.covariance->transpose());
    const geometry::Vector6d error = (result.T_rig_world * seen.T_world_rig).log();
    normalised += error.dot(result.covariance->llt().solve(error)) / kFrames;
  }
  EXPECT_GT(normalised, 4.8);  // six on average, with a standard deviation of 0.45 over 60 independent frames
  EXPECT_LT(normalised, 7.2);
}

TEST(Tracker, TracksFromTheRelocalisedPlaceAfterALoss) {
  TrackerRun run(synthetic::ring_rig(2));
  for (int i = 0; i < 5; ++i) run.process(run.frame(i));
  const SE3 T_rig_odom = run.state.T_rig_odom;
  const FrameRecord lost = run.process(elsewhere(run.frame(5)));
  EXPECT_EQ(lost.result.status, TrackStatus::kLost);
  EXPECT_FALSE(lost.twist);
  EXPECT_FALSE(lost.result.anchored.reference.valid());
  EXPECT_EQ(lost.T_rig_odom.translation(), T_rig_odom.translation());

  run.state.track.anchored = {};  // no last pose: only the relocaliser can locate it
  const FrameRecord blind = run.process(run.frame(6));
  EXPECT_EQ(blind.result.reason, LostReason::kNotFound);

  const map::MapSnapshot map = run.store.snapshot();
  FoundPlace place{KeyframeId(0), relative(run.sim, 0, 7), {}, 50};
  const map::BundledKeyframe& keyframe = map->keyframe(KeyframeId(0));
  for (std::size_t f = 0; f < keyframe.landmarks.size(); ++f) {
    if (map->alive(keyframe.landmarks[f]))
      place.matches.emplace_back(FeatureId(place.matches.size()), keyframe.landmarks[f]);
  }
  run.place = place;
  const FrameRecord found = run.process(run.frame(7));
  ASSERT_EQ(found.result.status, TrackStatus::kTracking) << describe(found.result.reason);
  EXPECT_LT(map::distance_m(found.result.T_rig_world, relative(run.sim, 0, 7)), 0.03);
  ASSERT_TRUE(found.relocalisation);
  EXPECT_EQ(found.relocalisation->matched_keyframe, KeyframeId(0));
  EXPECT_LT(map::distance_m(found.T_rig_odom, T_rig_odom), 1e-9);  // the odometry pose is continuous
  EXPECT_LT(map::distance_m(found.T_rig_odom, found.result.T_rig_world * found.T_map_odom), 1e-9);
}

TEST(Tracker, RefusesAPlaceOutOfReachWithLittleEvidence) {
  TrackerRun run(synthetic::ring_rig(2));
  int i = 0;
  while (i < 5) run.process(run.frame(i++));
  while (i < 17) run.process(elsewhere(run.frame(i++)));  // longer than a motion is predicted
  const SE3 far(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, 0, 50));
  const auto refused = [&](const SE3& T_rig_world, double found_ratio) {
    run.place = FoundPlace{KeyframeId(0), T_rig_world, {}, 50, found_ratio};
    run.refused = 0;
    run.propose(elsewhere(run.frame(i)));
    return run.refused;
  };
  EXPECT_EQ(refused(far * relative(run.sim, 0, i), 0.3), 1);
  EXPECT_EQ(refused(far * relative(run.sim, 0, i), 0.5), 0);
  EXPECT_EQ(refused(relative(run.sim, 0, i), 0.3), 0);
}

TEST(Tracker, KeepsTheTwistIfAFrameFollowsImmediately) {
  TrackerRun run(synthetic::ring_rig(2));
  for (int i = 0; i < 6; ++i) run.process(run.frame(i));
  const auto shortly_after = [&](int k) {
    return run.sim.frame(FrameId(5 + k), TrackerRun::time_s(5) + 0.001 * k).frame;
  };
  const geometry::Vector6d before = run.state.track.twist.value();
  ASSERT_EQ(run.process(shortly_after(1)).result.status, TrackStatus::kTracking);
  EXPECT_EQ(run.state.track.twist.value(), before);
  ASSERT_EQ(run.process(shortly_after(2)).result.status, TrackStatus::kTracking);  // some cameras are that fast
  EXPECT_NE(run.state.track.twist.value(), before);
}

TEST(Tracker, FindsTheRigNearItsLastPoseIfThePredictionIsWrong) {
  TrackerRun run(synthetic::ring_rig(2));
  for (int i = 0; i < 6; ++i) run.process(run.frame(i));
  (*run.state.track.twist)(1) += 12;  // 0.6 rad until the next frame
  EXPECT_EQ(run.process(run.frame(6)).result.status, TrackStatus::kTracking);
}

TEST(Tracker, LocaliseOnlyProposesNoEdits) {
  TrackerRun made(synthetic::ring_rig(2));
  for (int i = 0; i < 3; ++i) made.process(made.frame(i));
  TrackerOptions options;
  options.localize_only = true;
  options.new_submap_after = 1;
  TrackerRun run(made.sim, options, *made.store.snapshot());
  run.state = made.state;
  for (int i = 3; i < 20; ++i) {
    const TrackOutcome outcome = run.propose(i < 12 ? run.frame(i) : elsewhere(run.frame(i)));
    EXPECT_FALSE(outcome.edit) << "frame " << i;
    EXPECT_EQ(outcome.record.result.status, i < 12 ? TrackStatus::kTracking : TrackStatus::kLost) << "frame " << i;
    run.state = outcome.next;
  }
  EXPECT_TRUE(run.state.track.visibility_counts.empty());
}

TEST(Tracker, FollowsTheScaleOfItsSubmap) {
  TrackerRun run(synthetic::ring_rig(2));
  for (int i = 0; i < 5; ++i) run.process(run.frame(i));
  map::MapDraft draft(run.store.snapshot());
  ASSERT_TRUE(draft.scale_submap(KeyframeId(0), 2.0));
  run.store.commit(std::move(draft));
  const geometry::Vector6d before = *run.state.track.twist;
  const FrameRecord record = run.process(run.frame(5));
  ASSERT_EQ(record.result.status, TrackStatus::kTracking);
  EXPECT_LT(map::distance_m(record.result.T_rig_world, geometry::scaled(relative(run.sim, 0, 5), 2.0)), 0.06);
  EXPECT_NEAR(record.twist->tail<3>().norm() / before.tail<3>().norm(), 2.0, 0.4);
}

TEST(Tracker, PlanSkipsFaultyCameras) {
  TrackerRun run(synthetic::ring_rig(2));
  image::ImageBundle images;
  images.images.resize(2);
  for (image::CameraImage& i : images.images) i.state = image::ImageState::kPresent;
  const ImageFaults faults{{CameraReason::kNone, CameraReason::kBlack}, {0, 0}, {0, 1}};
  const FramePlan plan = run.tracker.plan(images, faults, run.state);
  EXPECT_EQ(plan.skipped, (std::vector<std::uint8_t>{0, 1}));
  EXPECT_EQ(plan.postponed, (std::vector<std::uint8_t>{0, 0}));
  EXPECT_GT(plan.budgets[0], 0);
  EXPECT_EQ(plan.budgets[1], 0);
}

TEST(Tracker, ABlurredCameraIsReadmittedOnceItIsSharp) {
  TrackerRun run(synthetic::ring_rig(2));
  for (int i = 0; i < 3; ++i) run.process(run.frame(i));
  image::ImageBundle images;
  images.images.resize(2);
  run.state.track.cameras[1].excluded = true;
  const auto plan = [&](std::uint8_t blurred) {
    run.tracker.plan(images, {{CameraReason::kNone, CameraReason::kNone}, {0, blurred}, {0, 0}}, run.state);
  };
  plan(1);
  EXPECT_TRUE(run.state.track.cameras[1].excluded);
  plan(0);
  EXPECT_FALSE(run.state.track.cameras[1].excluded);
}

}  // namespace
}  // namespace bslam::tracking
