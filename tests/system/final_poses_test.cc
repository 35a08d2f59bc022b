#include "system/final_poses.h"

#include <gtest/gtest.h>

#include "map/synthetic_map.h"

namespace bslam::system {
namespace {

using geometry::SE3;
using geometry::Vector3d;
using geometry::Vector6d;
using tracking::FrameRecord;
using tracking::Relocalisation;

constexpr TimeNs kInterval = 50'000'000, kDelay = 40'000'000;

// A rig that rotates and translates with constant acceleration.
Vector3d place(double t) { return {1.0 * t + 0.9 * t * t, 0.4 * t - 0.6 * t * t, 0.2 * t}; }
SE3 pose(double t, double turn_rate) {
  const geometry::Quaterniond R_rig_world = geometry::so3_exp({0, turn_rate * t, 0});
  return SE3(R_rig_world, -(R_rig_world * place(t)));
}

// Frames around a keyframe of two cameras, of which the second captures late; all are anchored to the keyframe.
struct Scene {
  explicit Scene(double turn_rate, std::size_t count = 5) {
    const double from = -to_seconds(kInterval) * static_cast<double>(count / 2);
    for (std::size_t i = 0; i < count; ++i) {
      FrameRecord record;
      record.result.frame = FrameId(i);
      record.result.time_ns = 1'000'000'000 + static_cast<TimeNs>(i) * kInterval;
      record.result.status = tracking::TrackStatus::kTracking;
      record.result.anchored.reference = KeyframeId(0);
      record.result.anchored.T_rig_reference =
          pose(from + to_seconds(kInterval) * static_cast<double>(i), turn_rate) * pose(0, turn_rate).inverse();
      frames.push_back(std::move(record));
    }
    auto frame = std::make_shared<frame::BundledFrame>(*map::synthetic_frame(random, 2, 30, 10));
    frame->id = FrameId(count / 2);
    frame->time_ns = frames[count / 2].result.time_ns;
    for (frame::CameraFrame& c : frame->cameras) c.state = image::ImageState::kPresent;
    frame->cameras[0].time_ns = frame->time_ns;
    frame->cameras[1].time_ns = frame->time_ns + kDelay;
    map.add_keyframe(frame, pose(0, turn_rate), {}, KeyframeId());
  }
  // Error of the rig's pose at the late camera's time, sum of rad and m.
  double error(const Vector6d& twist, double turn_rate) const {
    const double delay_s = to_seconds(kDelay);
    return (SE3::exp(delay_s * twist) * pose(0, turn_rate) * pose(delay_s, turn_rate).inverse()).log().norm();
  }

  Random random{1, "final poses test"};
  map::BundledMap map{map::synthetic_rig(2)};
  std::vector<FrameRecord> frames;
};

TEST(FinalPoses, MotionInterpolatesTheAdjacentFrames) {
  const Scene straight(0.0);
  auto found = twists_from_neighbours(straight.map, KeyframeId(0), straight.frames);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].first, KeyframeId(0));
  EXPECT_LT(straight.error(found[0].second, 0.0), 1e-12);
  const Scene turning(0.8);  // the error is of third order in the interval
  found = twists_from_neighbours(turning.map, KeyframeId(0), turning.frames);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_LT(turning.error(found[0].second, 0.8), 2e-5);
}

TEST(FinalPoses, MotionIsInTheUnitOfTheMap) {
  Scene scene(0.0);
  ASSERT_TRUE(scene.map.scale_submap(KeyframeId(0), 3.0));
  const auto before = twists_from_neighbours(Scene(0.0).map, KeyframeId(0), scene.frames);
  const auto found = twists_from_neighbours(scene.map, KeyframeId(0), scene.frames);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_TRUE(found[0].second.tail<3>().isApprox(3.0 * before.at(0).second.tail<3>(), 1e-12));
}

TEST(FinalPoses, NoMotionIfAnAdjacentFrameIsMissing) {
  Scene lost(0.3);
  lost.frames[3].result.status = tracking::TrackStatus::kLost;
  EXPECT_TRUE(twists_from_neighbours(lost.map, KeyframeId(0), lost.frames).empty());
  Scene pause(0.3);
  for (std::size_t i = 3; i < pause.frames.size(); ++i) pause.frames[i].result.time_ns += 1'000'000'000;
  EXPECT_TRUE(twists_from_neighbours(pause.map, KeyframeId(0), pause.frames).empty());
  const Scene alone(0.3, 1);
  EXPECT_TRUE(twists_from_neighbours(alone.map, KeyframeId(0), alone.frames).empty());
}

TEST(FinalPoses, MotionOfTheFirstFrameFollowsFromTheNextTwo) {
  for (const double turn_rate : {0.0, 0.3}) {
    Scene scene(turn_rate);
    scene.frames[1].result.status = tracking::TrackStatus::kLost;
    const auto found = twists_from_neighbours(scene.map, KeyframeId(0), scene.frames);
    ASSERT_EQ(found.size(), 1u);
    EXPECT_LT(scene.error(found[0].second, turn_rate), turn_rate == 0 ? 1e-12 : 1e-4);
  }
}

TEST(FinalPoses, NoMotionAcrossARelocalisation) {
  Scene after(0.3);
  after.frames[3].relocalisation = Relocalisation{KeyframeId(0), 50};
  EXPECT_TRUE(twists_from_neighbours(after.map, KeyframeId(0), after.frames).empty());
  Scene at(0.3);
  at.frames[2].relocalisation = Relocalisation{KeyframeId(0), 50};
  const auto found = twists_from_neighbours(at.map, KeyframeId(0), at.frames);  // from the frames after it
  ASSERT_EQ(found.size(), 1u);
  EXPECT_LT(at.error(found[0].second, 0.3), 1e-4);
  Scene scene(0.3);
  scene.frames[1].relocalisation = Relocalisation{KeyframeId(0), 50};  // the relocalisation precedes that pose
  EXPECT_EQ(twists_from_neighbours(scene.map, KeyframeId(0), scene.frames).size(), 1u);
}

TEST(FinalPoses, NoMotionBetweenSubmaps) {
  Scene scene(0.3);
  const KeyframeId other =
      scene.map.add_keyframe(map::synthetic_frame(scene.random, 2, 30, 10), SE3(), {}, KeyframeId());
  scene.frames[3].result.anchored.reference = other;
  EXPECT_TRUE(twists_from_neighbours(scene.map, KeyframeId(0), scene.frames).empty());
}

TEST(FinalPoses, MotionOfAnEarlierRunIsKept) {
  const Scene scene(0.3);
  EXPECT_TRUE(twists_from_neighbours(scene.map, KeyframeId(1), scene.frames).empty());
}

TEST(FinalPoses, NoMotionWithoutLateCameras) {
  Scene scene(0.3);
  auto together = std::make_shared<frame::BundledFrame>(*scene.map.keyframe(KeyframeId(0)).frame);
  together->cameras[1].time_ns = together->time_ns;
  map::BundledMap map(map::synthetic_rig(2));
  map.add_keyframe(together, SE3(), {}, KeyframeId());
  EXPECT_TRUE(twists_from_neighbours(map, KeyframeId(0), scene.frames).empty());
}

// Odometry that drifts linearly between two keyframes is corrected exactly; frames at the keyframes have their poses.
TEST(FinalPoses, FramesBetweenKeyframesFitBoth) {
  const Scene scene(0.0, 11);
  map::BundledMap map = scene.map;  // its keyframe is frame 5
  auto last = std::make_shared<frame::BundledFrame>(*map.keyframe(KeyframeId(0)).frame);
  last->id = FrameId(10);
  const SE3 at_last(geometry::Quaterniond::Identity(), {-0.3, 0.1, 0.2});
  ASSERT_EQ(map.add_keyframe(last, at_last * map.keyframe(KeyframeId(0)).T_rig_world, {}, KeyframeId(0)),
            KeyframeId(1));
  std::vector<FrameRecord> frames = scene.frames;
  const SE3 odometry_at_last(geometry::Quaterniond::Identity(), {-0.31, 0.08, 0.23});
  for (std::size_t i = 5; i < frames.size(); ++i) {
    const double weight = static_cast<double>(i - 5) / 5;
    frames[i].T_rig_odom = SE3(geometry::Quaterniond::Identity(), weight * odometry_at_last.translation());
  }
  const auto poses = poses_between_keyframes(map, KeyframeId(0), frames);
  ASSERT_EQ(poses.size(), frames.size());
  for (std::size_t i = 5; i < frames.size(); ++i) {
    const double weight = static_cast<double>(i - 5) / 5;
    const SE3 expected = SE3(geometry::Quaterniond::Identity(), weight * at_last.translation()) *
                         map.keyframe(KeyframeId(0)).T_rig_world;
    ASSERT_TRUE(poses[i]);
    EXPECT_LT((poses[i]->matrix() - expected.matrix()).norm(), 1e-12) << i;
  }
  EXPECT_EQ(poses[2]->matrix(), T_rig_world_of(frames[2], map)->matrix());  // before the first keyframe
  frames[7].result.status = tracking::TrackStatus::kLost;                   // interrupted: nothing is distributed
  const auto interrupted = poses_between_keyframes(map, KeyframeId(0), frames);
  EXPECT_FALSE(interrupted[7]);
  EXPECT_EQ(interrupted[8]->matrix(), T_rig_world_of(frames[8], map)->matrix());
}

// Odometry of a wrong scale until the calibration changes: the frames after the change keep the poses that they have
// relative to the last keyframe, and the difference is distributed over the frames before it.
TEST(FinalPoses, FramesAfterAChangeOfTheCalibrationDoNotShareTheErrorOfThoseBeforeIt) {
  Scene scene(0.0, 11);
  map::BundledMap& map = scene.map;  // its keyframe is frame 5
  auto last = std::make_shared<frame::BundledFrame>(*map.keyframe(KeyframeId(0)).frame);
  last->id = FrameId(10);
  const SE3 T_start = map.keyframe(KeyframeId(0)).T_rig_world;
  const auto moved = [](double steps) { return SE3(geometry::Quaterniond::Identity(), {-0.1 * steps, 0, 0}); };
  ASSERT_EQ(map.add_keyframe(last, moved(5) * T_start, {}, KeyframeId(0)), KeyframeId(1));
  for (std::size_t i = 5; i < scene.frames.size(); ++i) {
    const double step = static_cast<double>(i - 5);
    scene.frames[i].result.anchored = map::AnchoredPose::at(map, KeyframeId(0), moved(step) * T_start);
    scene.frames[i].T_rig_odom = i < 8 ? moved(0.5 * step) : moved(1.0 + step - 2);
  }
  scene.frames[8].recalibrated = true;
  const auto poses = poses_between_keyframes(map, KeyframeId(0), scene.frames);
  for (std::size_t i = 8; i < scene.frames.size(); ++i) {
    ASSERT_TRUE(poses[i]);
    EXPECT_LT((poses[i]->matrix() - (moved(static_cast<double>(i - 5)) * T_start).matrix()).norm(), 1e-12) << i;
  }
  EXPECT_LT((poses[6]->matrix() - (moved(1) * T_start).matrix()).norm(), 0.02);
}

// The map is scaled between frames 7 and 8, and once more at the end. The rig moves at a varying speed, so that the
// difference to the second keyframe, distributed over time, would not make up for another scale of the motion.
TEST(FinalPoses, FramesBetweenKeyframesAreAtTheScaleOfTheMap) {
  Scene scene(0.0, 11);
  map::BundledMap& map = scene.map;  // its keyframe is frame 5
  constexpr double kPosition[] = {0, 0.1, 0.5, 0.6, 0.6, 1.0}, kFirst = 2.0, kSecond = 1.5;
  const auto moved = [](double x) { return SE3(geometry::Quaterniond::Identity(), {x, 0, 0}); };
  const auto track = [&](std::size_t i, double scale) {
    FrameRecord& now = scene.frames[5 + i];
    now.result.anchored = map::AnchoredPose::at(map, KeyframeId(0),
                                                moved(scale * kPosition[i]) * map.keyframe(KeyframeId(0)).T_rig_world);
    if (i > 0) now.T_rig_odom = moved(scale * (kPosition[i] - kPosition[i - 1])) * scene.frames[4 + i].T_rig_odom;
  };
  for (std::size_t i = 0; i < 3; ++i) track(i, 1.0);
  ASSERT_TRUE(map.scale_submap(KeyframeId(0), kFirst));
  for (std::size_t i = 3; i < 6; ++i) track(i, kFirst);
  auto last = std::make_shared<frame::BundledFrame>(*map.keyframe(KeyframeId(0)).frame);
  last->id = FrameId(10);
  map.add_keyframe(last, moved(kFirst * kPosition[5]) * map.keyframe(KeyframeId(0)).T_rig_world, {}, KeyframeId(0));
  ASSERT_TRUE(map.scale_submap(KeyframeId(0), kSecond));
  const auto poses = poses_between_keyframes(map, KeyframeId(0), scene.frames);
  for (std::size_t i = 0; i < 6; ++i) {
    const SE3 expected = moved(kFirst * kSecond * kPosition[i]) * map.keyframe(KeyframeId(0)).T_rig_world;
    ASSERT_TRUE(poses[5 + i]);
    EXPECT_LT((poses[5 + i]->matrix() - expected.matrix()).norm(), 1e-12) << i;
  }
}

}  // namespace
}  // namespace bslam::system
