#include "tracking/scene_agreement.h"

#include <gtest/gtest.h>

#include "tracking/robust_pose.h"
#include "tracking/simulated_tracker.h"

namespace bslam::tracking {
namespace {

class SceneAgreement : public ::testing::Test {
 protected:
  SceneAgreement() {
    const KeyframeId last = world.map.keyframe_ids().back();
    state.anchored = map::AnchoredPose::at(world.map, last, world.map.resolved_pose(last));
    const std::vector<LandmarkId> all = world.map.landmark_ids();
    ThreadPool pool(2);
    const FrameMatches found = find_landmarks(world.map, seen.frame, truth, all, {}, {.radius = 0.02}, pool).found;
    observations = pose_observations(world.map, seen.frame, found, {.sigma_px = 0.7, .pyramid = {}});
  }

  TrackInput input() const { return {.map = world.map, .pyramids = {}, .alignment = {}, .state = state}; }
  int cells(const geometry::SE3& T_rig_world) const {
    return SceneMatches(input(), seen.frame, observations, truth).agreeing_cells(T_rig_world);
  }

  map::SimulatedMap world = true_map(simulator(synthetic::default_rig()), 1.0, 0.5);
  synthetic::SimulatedFrame seen = world.sim.frame(FrameId(100), 1.1);
  geometry::SE3 truth = seen.T_world_rig.inverse();
  TrackerState state;
  std::vector<solver::PoseObservation> observations;
};

TEST_F(SceneAgreement, MostCellsAgreeWithTheMotionOfTheRigAndFewWithAnother) {
  const int right = cells(truth);
  EXPECT_GT(right, 60);
  const geometry::SE3 moved = truth.perturbed((geometry::Vector6d() << 0, 0, 0, 0.1, 0.05, 0.1).finished());
  EXPECT_LT(cells(moved), 0.7 * right);
  const geometry::SE3 turned = truth.perturbed((geometry::Vector6d() << 0.02, 0.02, 0, 0, 0, 0).finished());
  EXPECT_LT(cells(turned), 0.3 * right);
}

// What moves with the rig has the same place in both images.
TEST_F(SceneAgreement, PointsAtInfinityAgreeWithAnyTranslation) {
  seen.frame = *world.map.keyframe(state.anchored.reference).frame;
  const geometry::SE3 at_rest = world.map.resolved_pose(state.anchored.reference);
  const geometry::SE3 moved = at_rest.perturbed((geometry::Vector6d() << 0, 0, 0, 0.1, 0.05, 0.1).finished());
  EXPECT_GT(cells(at_rest), 60);
  EXPECT_EQ(cells(moved), cells(at_rest));
}

TEST_F(SceneAgreement, AMapIsNewForItsFirstSecond) {
  EXPECT_FALSE(newly_started(input(), seen.frame));
  seen.frame.time_ns = world.map.keyframe(world.map.root_of(state.anchored.reference)).frame->time_ns;
  EXPECT_TRUE(newly_started(input(), seen.frame));
}

}  // namespace
}  // namespace bslam::tracking
