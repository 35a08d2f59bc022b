#include "tracking/tracker.h"

#include <gtest/gtest.h>

#include "tracking/simulated_tracker.h"

namespace bslam::tracking {
namespace {

using geometry::SE3;

// A relocaliser that returns a given place, and counts how often the tracker does not find it plausible.
class FixedPlaceRelocaliser : public Relocaliser {
 public:
  FixedPlaceRelocaliser(const std::optional<FoundPlace>& place, int& refused) : place_(place), refused_(refused) {}
  void describe(frame::BundledFrame&) const override {}
  std::optional<FoundPlace> verify_place(const map::BundledMap&, const frame::BundledFrame&,
                                         const std::function<bool(const FoundPlace&)>& plausible) override {
    if (!place_ || plausible(*place_)) return place_;
    ++refused_;
    return std::nullopt;
  }

 private:
  const std::optional<FoundPlace>& place_;
  int& refused_;
};

// A tracker and its map, fed with simulated frames of the orbit.
class TrackerRun {
 public:
  explicit TrackerRun(camera::Rig rig, const TrackerOptions& options = {})
      : TrackerRun(simulator(std::move(rig)), options) {}
  explicit TrackerRun(synthetic::FeatureSimulator simulator, const TrackerOptions& options = {})
      : TrackerRun(simulator, options, map::BundledMap(std::make_shared<const camera::Rig>(simulator.rig()))) {}
  TrackerRun(synthetic::FeatureSimulator simulator, const TrackerOptions& options, map::BundledMap map)
      : sim(std::move(simulator)),
        store(std::move(map)),
        tracker(sim.rig(), options, pool_, std::make_unique<FixedPlaceRelocaliser>(place, refused)),
        pyramids(map::flat_pyramids(sim.rig().size())) {}

  frame::BundledFrame frame(int i) const { return sim.frame(FrameId(i), time_s(i)).frame; }
  static double time_s(int i) { return 0.05 * i; }

  TrackOutcome propose(frame::BundledFrame frame, DirectAttempt direct = {}) {
    frame.twist = state.track.twist.value_or(geometry::Vector6d::Zero());
    return tracker.process(state, std::move(frame), pyramids, store.snapshot(), std::move(direct));
  }
  FrameRecord process(frame::BundledFrame frame, DirectAttempt direct = {}) {
    TrackOutcome outcome = propose(std::move(frame), std::move(direct));
    if (outcome.edit) tracker.committed(store.commit(std::move(outcome.edit->draft)), outcome);
    state = std::move(outcome.next);
    return outcome.record;
  }

  synthetic::FeatureSimulator sim;
  map::MapStore store;
  std::optional<FoundPlace> place;
  int refused = 0;
  FrontEndState state;

 private:
  ThreadPool pool_{1};

 public:
  Tracker tracker;
  std::vector<image::Pyramid> pyramids;
};

SE3 relative(const synthetic::FeatureSimulator& sim, int from, int to) {
  const auto T_world_rig = [&](int i) { return sim.frame(FrameId(i), TrackerRun::time_s(i)).T_world_rig; };
  return T_world_rig(to).inverse() * T_world_rig(from);
}

// A frame in which nothing can be recognised: every descriptor is replaced.
frame::BundledFrame elsewhere(frame::BundledFrame frame) {
  Random random(99);
  for (frame::CameraFrame& c : frame.cameras) {
    std::vector<feature::Descriptor> descriptors(c.keypoints.size());
    for (feature::Descriptor& d : descriptors) d = {random.next(), random.next(), random.next(), random.next()};
    c.keypoints.descriptor = std::move(descriptors);
  }
  return frame;
}

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

// A front, a left and a right camera, which observe nothing in common.
camera::Rig rig_without_overlap() {
  const camera::Rig all = synthetic::default_rig();
  std::vector<camera::RigCamera> cameras;
  for (const std::size_t c : {0, 2, 3}) cameras.push_back({all.camera(c), all.body_from_cam(c)});
  return camera::Rig(std::move(cameras));
}

// The reference frames of a monocular start after some frames, each with an image of the given camera only.
std::vector<FrameId> start_references(const std::vector<int>& cameras) {
  TrackerRun run(rig_without_overlap());
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    std::vector<int> missing = {0, 1, 2};
    std::erase(missing, cameras[i]);
    run.process(run.sim.frame(FrameId(i), 0.01 * static_cast<double>(i), missing).frame);
  }
  std::vector<FrameId> out;
  for (const StartReference& reference : run.state.start_references) out.push_back(reference.candidate->frame->id);
  return out;
}

TEST(Tracker, AStartWaitsForTheCamerasOfItsFirstFrameForOneRoundOnly) {
  using Frames = std::vector<FrameId>;
  EXPECT_EQ(start_references({0, 1, 2, 0, 1, 2, 0}), Frames({FrameId(0), FrameId(1), FrameId(2)}))
      << "one after the other";
  EXPECT_EQ(start_references({1, 0, 0}), Frames({FrameId(0), FrameId(1)}));
  EXPECT_EQ(start_references({1, 0, 0, 0}), Frames({FrameId(1)})) << "there are no images of camera 1 any more";
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
  run.state.pending = {FrameId(i), record.result.anchored, map->keyframe_slots(), 0};
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

TEST(Tracker, DoesNotWaitForeverForAKeyframe) {
  TrackerRun run(synthetic::ring_rig(2));
  for (int i = 0; i < 3; ++i) run.process(run.frame(i));
  run.state.pending = {FrameId(2), run.state.track.anchored, run.store.snapshot()->keyframe_slots(), 0};
  int waited = 0;
  for (; run.state.pending && waited < 100; ++waited) run.tracker.adopt_keyframe(*run.store.snapshot(), run.state);
  EXPECT_EQ(waited, kMaxPendingFrames + 1);
  EXPECT_TRUE(run.state.keyframe_failed);
  run.process(run.frame(3));
  EXPECT_FALSE(run.state.keyframe_failed);
}

TEST(Tracker, AFrameWithoutAPoseForgetsThePendingKeyframe) {
  TrackerRun run(synthetic::ring_rig(2));
  for (int i = 0; i < 4; ++i) run.process(run.frame(i));
  run.state.pending = {FrameId(3), run.state.track.anchored, run.store.snapshot()->keyframe_slots(), 0};
  run.process(elsewhere(run.frame(4)));
  EXPECT_FALSE(run.state.pending);
}

// A video with repeated images has a frame without any after each one.
TEST(Tracker, AFrameWithoutImagesKeepsThePendingKeyframe) {
  TrackerRun run(synthetic::ring_rig(2));
  for (int i = 0; i < 4; ++i) run.process(run.frame(i));
  run.state.pending = {FrameId(3), run.state.track.anchored, run.store.snapshot()->keyframe_slots(), 0};
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

TEST(Tracker, OneCameraInitialisesUpToScaleAndLocatesTheEarlierFrames) {
  TrackerRun run(simulator(synthetic::ring_rig(1), room(1, 0.25), {.radius = 2.2, .period_s = 20}));
  TrackOutcome outcome;
  int i = 0;
  for (; i < 40 && !outcome.edit; ++i) {
    outcome = run.propose(run.frame(i));
    EXPECT_EQ(outcome.record.result.reason, LostReason::kNotStarted);
    run.state = outcome.next;
  }
  ASSERT_TRUE(outcome.edit);
  EXPECT_EQ(outcome.edit->kind, ProposedEdit::Kind::kStart);
  run.tracker.committed(run.store.commit(std::move(outcome.edit->draft)), outcome);
  EXPECT_EQ(outcome.record.result.status, TrackStatus::kTracking);
  ASSERT_EQ(outcome.early.size(), static_cast<std::size_t>(i - 1));
  const SE3 last = relative(run.sim, 0, i - 1);
  const double scale =
      outcome.record.result.T_rig_world.inverse().translation().norm() / last.inverse().translation().norm();
  for (int k = 0; k < i - 1; ++k) {
    const auto found = run.tracker.locate_early(*run.store.snapshot(), outcome.early[static_cast<std::size_t>(k)]);
    ASSERT_TRUE(found) << "frame " << k;
    EXPECT_LT(map::distance_m(found->T_rig_world, geometry::scaled(relative(run.sim, 0, k), scale)), 0.05 * scale);
  }
}

// Each frame has an image of one camera only, so that no two successive frames can be compared.
TEST(Tracker, CamerasThatTakeTurnsInitialiseFromFramesOfTheSameCamera) {
  TrackerRun run(simulator(synthetic::ring_rig(2), room(1, 0.25), {.radius = 2.2, .period_s = 20}));
  bool started = false;
  for (int i = 0; i < 60 && !started; ++i) {
    const int missing[] = {i % 2};
    const FrameRecord record = run.process(run.sim.frame(FrameId(i), TrackerRun::time_s(i), missing).frame);
    started = record.result.status == TrackStatus::kTracking;
  }
  EXPECT_TRUE(started);
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

TEST(Tracker, StartsANewSubmapIfItStaysLost) {
  TrackerOptions options;
  options.new_submap_after = 3;
  TrackerRun run(synthetic::ring_rig(2), options);
  for (int i = 0; i < 3; ++i) run.process(run.frame(i));
  run.state.track.anchored = {};
  EXPECT_EQ(run.process(run.frame(3)).result.reason, LostReason::kNotFound);
  EXPECT_EQ(run.process(run.frame(4)).result.reason, LostReason::kNotFound);
  const FrameRecord started = run.process(run.frame(5));
  EXPECT_EQ(started.result.status, TrackStatus::kTracking);
  EXPECT_TRUE(started.keyframe);
  EXPECT_EQ(run.store.snapshot()->roots().size(), 2u);
  EXPECT_EQ(started.root, run.store.snapshot()->roots().back());
}

// Starts a map, declares it metric, loses the pose and continues, all without images of the cameras `missing`. Returns
// the frame with which a second submap is started; nullopt: with none of the next 80 frames.
std::optional<int> second_submap(const camera::Rig& rig, TrackerOptions options, const std::vector<int>& missing) {
  options.new_submap_after = 3;
  TrackerRun run(simulator(rig, room(1, 0.25), {.radius = 2.2, .period_s = 20}), options);
  const std::size_t n = rig.size();
  ImageFaults faults{std::vector<CameraReason>(n), std::vector<std::uint8_t>(n), std::vector<std::uint8_t>(n)};
  for (const int c : missing) faults.outage[static_cast<std::size_t>(c)] = CameraReason::kBlack;
  const auto process = [&](int i) {
    image::ImageBundle images;
    images.images.resize(n);
    images.time_ns = run.frame(i).time_ns;
    run.tracker.plan(images, faults, run.state);
    return run.process(run.sim.frame(FrameId(i), TrackerRun::time_s(i), missing).frame);
  };
  int i = 0;
  while (i < 60 && process(i).result.status != TrackStatus::kTracking) ++i;
  map::MapDraft draft(run.store.snapshot());
  draft.set_scale(map::Scale::kMetric);
  run.store.commit(std::move(draft));
  run.state.track.anchored = {};
  for (int end = i + 80; i < end && run.store.snapshot()->roots().size() < 2; ++i) process(i);
  if (run.store.snapshot()->roots().size() < 2) return std::nullopt;
  EXPECT_EQ(run.store.snapshot()->scale(), map::Scale::kUnobservable);
  return i;
}

// Cameras without overlap start a submap without scale, so that the map has none until it is known again.
TEST(Tracker, AMetricMapOfCamerasWithoutOverlapGetsANewSubmap) {
  const std::vector<int> apart = {2, 3};
  const camera::Rig rig = synthetic::default_rig().subset(apart);
  ASSERT_FALSE(rig.any_overlap());
  EXPECT_TRUE(second_submap(rig, {}, {}).has_value());
}

TEST(Tracker, ACameraThatHasFailedForSecondsDoesNotPreventANewSubmap) {
  const camera::Rig rig = synthetic::ring_rig(4);  // only the cameras 0 and 1 overlap
  const std::optional<int> started = second_submap(rig, {}, {1});
  ASSERT_TRUE(started.has_value());
  EXPECT_GT(TrackerRun::time_s(*started), 2.0);                              // it may return
  EXPECT_FALSE(second_submap(synthetic::ring_rig(2), {}, {1}).has_value());  // the scale of one camera stays unknown
}

TEST(Tracker, CamerasOfAnotherRigOfTheMapDoNotPreventANewSubmap) {
  TrackerOptions options;
  options.first_camera = 2;
  options.num_cameras = 2;
  EXPECT_TRUE(second_submap(synthetic::default_rig(), options, {0, 1}).has_value());
  options.num_cameras = 1;
  EXPECT_FALSE(second_submap(synthetic::default_rig(), options, {0, 1, 3}).has_value());
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

// At many frames per second, the number of frames alone would mean a short disturbance.
TEST(Tracker, StartsNoNewSubmapInAMomentAtAHighRate) {
  constexpr int kPerSecond = 200, kLost = 20;
  TrackerRun run(synthetic::ring_rig(2));
  const auto frame = [&](int i) { return run.sim.frame(FrameId(i), static_cast<double>(i) / kPerSecond).frame; };
  ASSERT_EQ(TrackerOptions().new_submap_after, kLost);
  for (int i = 0; i < 3; ++i) run.process(frame(i));
  run.state.track.anchored = {};
  int lost = 0;
  while (lost < 200 && run.process(frame(3 + lost)).result.status != TrackStatus::kTracking) ++lost;
  EXPECT_GT(lost, 2 * kLost);
  EXPECT_LT(lost, kPerSecond / 2);
}

// At few frames per second, the number of frames alone would mean a long time.
TEST(Tracker, StartsANewSubmapAfterATimeAndAFewFrames) {
  TrackerOptions options;
  options.new_submap_after_s = 0.0;
  TrackerRun run(synthetic::ring_rig(2), options);
  for (int i = 0; i < 3; ++i) run.process(run.frame(i));
  run.state.track.anchored = {};
  for (int i = 3; i < 7; ++i) EXPECT_EQ(run.process(run.frame(i)).result.reason, LostReason::kNotFound) << i;
  EXPECT_EQ(run.process(run.frame(7)).result.status, TrackStatus::kTracking);
  EXPECT_EQ(run.store.snapshot()->roots().size(), 2u);
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

// The next frame may show only some of the landmarks. A camera that never had an image does not count.
TEST(Tracker, NeedsMoreFeaturesForAMetricStartWhileCamerasLoseImages) {
  TrackerOptions options;
  options.tracking.min_inliers = 1000;
  for (const bool had_images : {true, false}) {
    TrackerRun run(synthetic::ring_rig(3), options);
    const auto plan = [&](int i, CameraReason of_camera_2) {
      image::ImageBundle images;
      images.images.resize(3);
      images.time_ns = run.frame(i).time_ns;
      run.tracker.plan(images, {{CameraReason::kNone, CameraReason::kNone, of_camera_2}, {0, 0, 0}, {0, 0, 0}},
                       run.state);
    };
    const auto starts = [&](int i, CameraReason of_camera_2) {
      plan(i, of_camera_2);
      run.process(run.frame(i));
      return run.store.snapshot()->num_keyframes() > 0;
    };
    plan(0, had_images ? CameraReason::kNone : CameraReason::kNoImages);
    EXPECT_EQ(starts(1, CameraReason::kNoImages), !had_images);
    EXPECT_EQ(starts(2, CameraReason::kNone), !had_images) << "shortly afterwards";
    EXPECT_TRUE(starts(45, CameraReason::kNone));
    EXPECT_EQ(run.store.snapshot()->scale(), map::Scale::kMetric);
  }
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
