// Places that the rig can have reached since its last pose, and its motion if images are early.
#include "tracking/motion_prediction.h"

#include <gtest/gtest.h>

#include "mapping/simulated_map.h"

namespace bslam::tracking {
namespace {

using frame::BundledFrame;
using geometry::SE3;
using geometry::Vector3d;

class IsPlausible : public ::testing::Test {
 protected:
  IsPlausible() : world_(synthetic::FeatureSimulator(synthetic::ring_rig(2), synthetic::make_orbit({}), {})) {
    const KeyframeId keyframe = world_.add_keyframe(FrameId(0), 0.0);
    place_ = {
        .matched_keyframe = keyframe, .T_rig_world = world_.true_pose(keyframe), .matches = {}, .found_ratio = 0.3};
    state_.time_ns = from_seconds(10.0);
    state_.anchored = map::AnchoredPose::at(world_.map, keyframe, place_.T_rig_world);
    state_.twist = geometry::Vector6d::Zero();
    state_.twist->tail<3>() = Vector3d(0.6, 0, 0.8);  // 1 m/s
  }
  // Two seconds after the last pose.
  bool at_distance(double distance_m) const {
    FoundPlace place = place_;
    place.T_rig_world = SE3(Eigen::Quaterniond::Identity(), Vector3d(0, distance_m, 0)) * place_.T_rig_world;
    return is_plausible(place, world_.map, state_, from_seconds(12.0));
  }

  map::SimulatedMap world_;
  FoundPlace place_;
  TrackerState state_;
};

TEST_F(IsPlausible, UpToTwiceTheLastSpeed) {
  EXPECT_TRUE(at_distance(3.9));
  EXPECT_FALSE(at_distance(4.1));
  state_.twist->setZero();
  EXPECT_FALSE(at_distance(0.1));
}

TEST_F(IsPlausible, AndByTheMedianDistanceOfTheLandmarks) {
  int plausible = 0, others = 0;
  for (const LandmarkId l : world_.map.landmark_ids()) {  // one metre from each of them in turn
    place_.matches = {{FeatureId(0), l}};
    const Vector3d point = world_.true_pose(place_.matched_keyframe) * world_.map.landmark(l).position;
    const Vector3d shift = Vector3d(0, 0, 1) - point;
    place_.T_rig_world = SE3(Eigen::Quaterniond::Identity(), shift) * world_.true_pose(place_.matched_keyframe);
    const bool expected = shift.norm() <= 4.0 + 1.0;
    EXPECT_EQ(is_plausible(place_, world_.map, state_, from_seconds(12.0)), expected) << shift.norm();
    ++(expected ? plausible : others);
  }
  EXPECT_GT(plausible, 0);
  EXPECT_GT(others, 0);
}

TEST_F(IsPlausible, IfTheLastPoseIsUnknownOrTheEvidenceIsClear) {
  ASSERT_FALSE(at_distance(50.0));
  place_.found_ratio = 0.5;
  EXPECT_TRUE(at_distance(50.0));
  place_.found_ratio = 0.3;
  place_.T_rig_world = SE3(Eigen::Quaterniond::Identity(), Vector3d(0, 50, 0)) * place_.T_rig_world;
  EXPECT_FALSE(is_plausible(place_, world_.map, state_, from_seconds(14.9)));
  EXPECT_TRUE(is_plausible(place_, world_.map, state_, from_seconds(15.1))) << "after a long time";
  TrackerState known = state_;
  state_.twist.reset();
  EXPECT_TRUE(at_distance(50.0));
  state_ = known;
  state_.anchored = {};
  EXPECT_TRUE(at_distance(50.0));
}

// A rig at rest whose last pose is wrong by one metre. In each frame, the poses are those that agree with all images,
// of which a share is captured in the middle since the last frame, and the others at the time of the frame.
class EarlyImages : public ::testing::Test {
 protected:
  static constexpr double kInterval_s = 0.1;

  EarlyImages() : world_(synthetic::FeatureSimulator(synthetic::ring_rig(2), synthetic::make_orbit({}), {})) {
    keyframe_ = world_.add_keyframe(FrameId(0), 0.0);
    frame_ = *world_.map.keyframe(keyframe_).frame;
  }
  // The motion model of the frame after this error of the last pose and this change of it before.
  solver::MotionModel model_after(double error_m, double change_m, int early, int on_time) {
    const SE3 T(Eigen::Quaterniond::Identity(), Vector3d(error_m, 0, 0));
    TrackerState state;
    state.anchored = map::AnchoredPose::at(world_.map, keyframe_, T);
    state.twist = geometry::Vector6d::Zero();
    (*state.twist)(3) = change_m / kInterval_s;
    state.twist_interval_s = kInterval_s;
    state.cameras.resize(2);
    state.cameras[0].landmarks.resize(static_cast<std::size_t>(on_time));
    state.cameras[1].landmarks.resize(static_cast<std::size_t>(early));
    frame_.time_ns = from_seconds(kInterval_s);
    for (frame::CameraFrame& c : frame_.cameras) c.time_ns = frame_.time_ns;
    frame_.cameras[1].time_ns -= from_seconds(0.5 * kInterval_s);
    return motion_model({.map = world_.map, .pyramids = {}, .alignment = {}, .state = state}, frame_);
  }
  // The error after some frames.
  double error_after(int frames, int early, int on_time) {
    double error = 1.0, change = 0.0;
    for (int i = 0; i < frames; ++i) {
      const solver::MotionModel motion = model_after(error, change, early, on_time);
      // x + delay twist(x) = 0 for the early images, x = 0 for the others, weighted by their numbers.
      const double slope = 1.0 + motion.delay_s[1] * motion.gain;
      const double constant = motion.delay_s[1] * (motion.offset(3) - motion.gain * error);
      const double x = -early * slope * constant / (on_time + early * slope * slope);
      change = x - error;
      error = x;
    }
    return std::abs(error);
  }

  map::SimulatedMap world_;
  KeyframeId keyframe_;
  BundledFrame frame_;
};

TEST_F(EarlyImages, AloneDoNotMakePosesAlternate) {
  EXPECT_LT(error_after(10, 100, 0), 0.01);
  EXPECT_LT(error_after(10, 100, 5), 0.01);
  EXPECT_LT(error_after(10, 100, 100), 0.01);
}

TEST_F(EarlyImages, HaveConstantAccelerationIfOthersAreOnTime) {
  // From the middle of the interval to the middle of the delay, in distances of the middles of the intervals.
  const double ahead = (kInterval_s - 0.5 * kInterval_s) / (2 * kInterval_s);
  EXPECT_NEAR(model_after(0.0, 0.0, 100, 100).gain, (1.0 + ahead) / kInterval_s, 1e-9);
  EXPECT_LT(model_after(0.0, 0.0, 100, 0).gain, 1.0 / kInterval_s);
}

}  // namespace
}  // namespace bslam::tracking
