// Starts of maps and of submaps by the tracker.
#include <gtest/gtest.h>

#include <cmath>

#include "matching/bundling.h"
#include "tracking/tracker_run.h"

namespace bslam::tracking {
namespace {

using geometry::SE3;

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

TEST(TrackerStart, AStartWaitsForTheCamerasOfItsFirstFrameForOneRoundOnly) {
  using Frames = std::vector<FrameId>;
  EXPECT_EQ(start_references({0, 1, 2, 0, 1, 2, 0}), Frames({FrameId(0), FrameId(1), FrameId(2)}))
      << "one after the other";
  EXPECT_EQ(start_references({1, 0, 0}), Frames({FrameId(0), FrameId(1)}));
  EXPECT_EQ(start_references({1, 0, 0, 0}), Frames({FrameId(1)})) << "there are no images of camera 1 any more";
}

TEST(TrackerStart, OneCameraInitialisesUpToScaleAndLocatesTheEarlierFrames) {
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
TEST(TrackerStart, CamerasThatTakeTurnsInitialiseFromFramesOfTheSameCamera) {
  TrackerRun run(simulator(synthetic::ring_rig(2), room(1, 0.25), {.radius = 2.2, .period_s = 20}));
  bool started = false;
  for (int i = 0; i < 60 && !started; ++i) {
    const int missing[] = {i % 2};
    const FrameRecord record = run.process(run.sim.frame(FrameId(i), TrackerRun::time_s(i), missing).frame);
    started = record.result.status == TrackStatus::kTracking;
  }
  EXPECT_TRUE(started);
}

TEST(TrackerStart, StartsANewSubmapIfItStaysLost) {
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
TEST(TrackerStart, AMetricMapOfCamerasWithoutOverlapGetsANewSubmap) {
  const std::vector<int> apart = {2, 3};
  const camera::Rig rig = synthetic::default_rig().subset(apart);
  ASSERT_FALSE(rig.any_overlap());
  EXPECT_TRUE(second_submap(rig, {}, {}).has_value());
}

TEST(TrackerStart, ACameraThatHasFailedForSecondsDoesNotPreventANewSubmap) {
  const camera::Rig rig = synthetic::ring_rig(4);  // only the cameras 0 and 1 overlap
  const std::optional<int> started = second_submap(rig, {}, {1});
  ASSERT_TRUE(started.has_value());
  EXPECT_GT(TrackerRun::time_s(*started), 2.0);                              // it may return
  EXPECT_FALSE(second_submap(synthetic::ring_rig(2), {}, {1}).has_value());  // the scale of one camera stays unknown
}

TEST(TrackerStart, CamerasOfAnotherRigOfTheMapDoNotPreventANewSubmap) {
  TrackerOptions options;
  options.first_camera = 2;
  options.num_cameras = 2;
  EXPECT_TRUE(second_submap(synthetic::default_rig(), options, {0, 1}).has_value());
  options.num_cameras = 1;
  EXPECT_FALSE(second_submap(synthetic::default_rig(), options, {0, 1, 3}).has_value());
}

// At many frames per second, the number of frames alone would mean a short disturbance.
TEST(TrackerStart, StartsNoNewSubmapInAMomentAtAHighRate) {
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
TEST(TrackerStart, StartsANewSubmapAfterATimeAndAFewFrames) {
  TrackerOptions options;
  options.new_submap_after_s = 0.0;
  TrackerRun run(synthetic::ring_rig(2), options);
  for (int i = 0; i < 3; ++i) run.process(run.frame(i));
  run.state.track.anchored = {};
  for (int i = 3; i < 7; ++i) EXPECT_EQ(run.process(run.frame(i)).result.reason, LostReason::kNotFound) << i;
  EXPECT_EQ(run.process(run.frame(7)).result.status, TrackStatus::kTracking);
  EXPECT_EQ(run.store.snapshot()->roots().size(), 2u);
}

// The next frame may show only some of the landmarks. A camera that never had an image does not count.
TEST(TrackerStart, NeedsMoreFeaturesForAMetricStartWhileCamerasLoseImages) {
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

// Two overlapping cameras, of which camera 1 captures in the middle between two images of camera 0.
class CapturedApart {
 public:
  explicit CapturedApart(bool recognisable) : run_(simulator_of_pair()), recognisable_(recognisable) {}

  // Nothing is matched between the cameras, since the motion is not known. In images of camera 1 that are not
  // recognisable, nothing shows the scale.
  frame::BundledFrame frame(int i) const {
    frame::BundledFrame out = run_.frame(i);
    if (!recognisable_) out.cameras[1] = elsewhere(out).cameras[1];
    out.bundled = matching::make_bundled(run_.sim.rig(), out.cameras, {}, 0.0, 0.0);
    out.motion_unknown = true;
    return out;
  }
  // The number of frames until the map has another submap, at most 80.
  int frames_until_start() {
    const std::size_t before = run_.store.snapshot()->roots().size();
    int n = 0;
    while (n < 80 && run_.store.snapshot()->roots().size() == before) {
      ++n;
      run_.process(frame(next_++));
    }
    return n;
  }
  void declare_metric_and_lose() {
    map::MapDraft draft(run_.store.snapshot());
    draft.set_scale(map::Scale::kMetric);
    run_.store.commit(std::move(draft));
    run_.state.track.anchored = {};
  }
  void recognise(bool recognisable) { recognisable_ = recognisable; }
  const map::MapSnapshot map() const { return run_.store.snapshot(); }

 private:
  static synthetic::FeatureSimulator simulator_of_pair() {
    synthetic::FeatureSimulatorOptions options = room(1, 0.25);
    options.capture_offset_s = {0, 0.025};
    return simulator(synthetic::ring_rig(2), options, {.radius = 2.2, .period_s = 20});
  }
  TrackerRun run_;
  bool recognisable_;
  int next_ = 0;
};

TEST(TrackerStart, CamerasThatCaptureApartWaitForTheirScale) {
  CapturedApart seen(true), unseen(false);
  EXPECT_LE(seen.frames_until_start(), 20);
  EXPECT_LT(seen.map()->scale_deviation(), 0.2);
  const int without_scale = unseen.frames_until_start();
  EXPECT_GT(without_scale, 20);
  EXPECT_LT(without_scale, 40);
  EXPECT_FALSE(std::isfinite(unseen.map()->scale_deviation()));
}

TEST(TrackerStart, AMetricMapOfCamerasThatCaptureApartGetsASubmapOnlyWithItsScale) {
  CapturedApart cameras(true);
  ASSERT_LT(cameras.frames_until_start(), 80);
  cameras.declare_metric_and_lose();
  cameras.recognise(false);
  EXPECT_EQ(cameras.frames_until_start(), 80);
  cameras.recognise(true);
  EXPECT_LT(cameras.frames_until_start(), 80);
  EXPECT_EQ(cameras.map()->roots().size(), 2u);
}

// Images of different times are matched while the rig rests, but not after a gap, nor once the rig has moved.
TEST(TrackerStart, RestIsKnownForAMomentOnly) {
  synthetic::FeatureSimulatorOptions options = room(1, 0.25);
  options.capture_offset_s = {0, 0.025};
  TrackerOptions no_start;
  no_start.tracking.initialisation.min_matched = 100'000;
  TrackerRun run(simulator(synthetic::ring_rig(2), options), no_start);
  const auto at = [](frame::BundledFrame frame, int i) {
    const TimeNs shift = from_seconds(TrackerRun::time_s(i)) - frame.time_ns;
    frame.id = FrameId(i);
    frame.time_ns += shift;
    for (frame::CameraFrame& c : frame.cameras) c.time_ns += shift;
    return frame;
  };
  const auto motion_unknown = [&](int i) {
    const TimeNs time_ns = from_seconds(TrackerRun::time_s(i)), late_ns = time_ns + from_seconds(0.025);
    const image::ImageBundle images{
        FrameId(i), time_ns, {{image::ImageState::kPresent, time_ns, {}}, {image::ImageState::kPresent, late_ns, {}}}};
    return run.tracker.plan(images, {{CameraReason::kNone, CameraReason::kNone}, {0, 0}, {0, 0}}, run.state)
        .motion_unknown;
  };
  run.process(run.frame(0));
  EXPECT_TRUE(motion_unknown(1));
  run.process(at(run.frame(0), 1));
  EXPECT_FALSE(motion_unknown(2));
  EXPECT_TRUE(motion_unknown(40));
  const frame::BundledFrame moved = run.frame(2);
  ASSERT_GT(moved.bundled.num_matched(), 0u);
  run.process(moved);
  EXPECT_TRUE(motion_unknown(3));
  EXPECT_EQ(run.state.waiting.back()->bundled.num_matched(), 0u);
  EXPECT_TRUE(run.state.waiting.back()->motion_unknown);
}

}  // namespace
}  // namespace bslam::tracking
