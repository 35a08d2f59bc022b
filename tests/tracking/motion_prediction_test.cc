// Places that the rig can have reached since its last pose.
#include "tracking/motion_prediction.h"

#include <gtest/gtest.h>

#include "mapping/simulated_map.h"

namespace bslam::tracking {
namespace {

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

}  // namespace
}  // namespace bslam::tracking
