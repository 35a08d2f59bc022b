// Start of a map by two overlapping cameras of which one captures in the middle between two images of the other.
#include "tracking/late_cameras.h"

#include <gtest/gtest.h>

#include "frame/capture_times.h"
#include "matching/bundling.h"
#include "tracking/initialise.h"
#include "tracking/simulated_tracker.h"

namespace bslam::tracking {
namespace {

using frame::BundledFrame;
using geometry::SE3;

class LateCameras : public ::testing::Test {
 protected:
  static constexpr double kInterval_s = 0.05, kDelay_s = 0.025;

  LateCameras() : sim_(late_simulator()) {}

  static synthetic::FeatureSimulator late_simulator() {
    synthetic::FeatureSimulatorOptions options = room(1, 0.25);
    options.capture_offset_s = {0, kDelay_s};
    return simulator(synthetic::ring_rig(2), options, {.radius = 2.2, .period_s = 20});
  }
  // The motion is not known, so that nothing is matched between the cameras.
  synthetic::SimulatedFrame seen(int i, std::span<const int> missing = {}) const {
    synthetic::SimulatedFrame out = sim_.frame(FrameId(i), kInterval_s * i, missing);
    out.frame.bundled = matching::make_bundled(sim_.rig(), out.frame.cameras, {}, 0.0, 0.0);
    out.frame.motion_unknown = true;
    return out;
  }
  struct Start {
    int last = 0;  // the map was started from frames 0 and this one
    map::MapDraft draft;
    std::optional<StartedMap> map;
  };
  // Tries the frames after frame 0 until there is enough parallax.
  Start start(std::span<const int> missing = {}) const {
    std::vector<std::shared_ptr<const BundledFrame>> frames = {
        std::make_shared<const BundledFrame>(seen(0, missing).frame)};
    const StartCandidate first{frames.front(), map::flat_pyramids(2)};
    Start out{0, empty_draft(), std::nullopt};
    while (out.last < 30 && !out.map) {
      const auto second = std::make_shared<const BundledFrame>(seen(++out.last, missing).frame);
      const StartFrames used{first, *second, first.pyramids, frames, /*scale_needed=*/true};
      out.map = initialise_monocular(used, {}, Random(1), out.draft);
      frames.push_back(second);
    }
    return out;
  }
  map::MapDraft empty_draft() const {
    return map::MapDraft(std::make_shared<const map::BundledMap>(std::make_shared<const camera::Rig>(sim_.rig())));
  }

  synthetic::FeatureSimulator sim_;
};

TEST_F(LateCameras, TheirImagesDetermineTheScale) {
  const Start started = start();
  ASSERT_TRUE(started.map);
  EXPECT_LT(started.map->scale_deviation, 0.1);
  const auto keyframe = [&](std::size_t i) { return started.draft.map().keyframe(started.map->keyframes[i].keyframe); };
  const SE3 moved = keyframe(1).T_rig_world * keyframe(0).T_rig_world.inverse();
  const SE3 truth = seen(started.last).T_world_rig.inverse() * seen(0).T_world_rig;
  EXPECT_NEAR(moved.translation().norm() / truth.translation().norm(), 1.0, 0.05);
  // The velocity of both keyframes is known, so that images of both cameras can be used.
  const geometry::Vector6d velocity = moved.log() / (started.last * kInterval_s);
  EXPECT_LT((keyframe(0).twist - velocity).norm(), 0.1 * velocity.norm());
  EXPECT_LT((keyframe(1).twist - velocity).norm(), 0.1 * velocity.norm());
}

TEST_F(LateCameras, WithoutTheirImagesNoMapIsStartedThatNeedsItsScale) {
  const std::vector<int> missing = {1};
  EXPECT_FALSE(start(missing).map);
}

TEST_F(LateCameras, CaptureApartWhileTheMotionIsUnknown) {
  BundledFrame frame = seen(0).frame;
  EXPECT_TRUE(frame::captured_apart(frame, CameraIndex(0), CameraIndex(1)));
  frame.motion_unknown = false;
  EXPECT_FALSE(frame::captured_apart(frame, CameraIndex(0), CameraIndex(1)));
}

TEST_F(LateCameras, CanBeComparedIfTheRigRests) {
  BundledFrame same = seen(0).frame;
  for (frame::CameraFrame& c : same.cameras) c.time_ns += from_seconds(kInterval_s);
  same.time_ns += from_seconds(kInterval_s);
  EXPECT_TRUE(at_rest(seen(0).frame, same));
  EXPECT_FALSE(at_rest(seen(0).frame, seen(1).frame));
  BundledFrame later = same;
  later.time_ns += from_seconds(0.5);
  EXPECT_FALSE(at_rest(seen(0).frame, later));
  for (frame::CameraFrame& c : same.cameras) c.time_ns = same.time_ns;  // nothing has to be known
  EXPECT_FALSE(at_rest(seen(0).frame, same));
}

}  // namespace
}  // namespace bslam::tracking
