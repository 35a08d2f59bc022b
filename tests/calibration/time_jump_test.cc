#include "calibration/time_jump.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "base/random.h"
#include "calibration/adjusted_map.h"
#include "calibration/estimate_warnings.h"
#include "calibration/rig_problem.h"
#include "mapping/simulated_map.h"

namespace bslam::calibration::jumps {
namespace {

using geometry::SE3;

constexpr feature::FeatureModel kFeatures{.sigma_px = 0.5, .pyramid = {}};
const CalibrationOptions kIndependent{.correlated_observations = 1};
constexpr int kKeyframes = 30;
constexpr double kStep_s = 0.3;

// The rig turns and walks to and fro, so that its velocity is different in every keyframe.
synthetic::Trajectory unsteady() {
  constexpr double kSpacing_s = 0.8;
  Random random(3, "unsteady");
  std::vector<synthetic::ControlPose> control;
  for (int i = 0; i < 18; ++i) {
    const Eigen::Vector3d position(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(1.2, 1.8));
    control.push_back({position, random.uniform(-0.5, 0.5), random.uniform(-0.15, 0.15), random.uniform(-0.15, 0.15)});
  }
  return {control, kSpacing_s};
}

synthetic::FeatureSimulator simulator(const camera::Rig& rig) {
  synthetic::FeatureSimulatorOptions options;
  options.landmarks = 2500;
  options.max_keypoints = 250;
  options.sigma_px = kFeatures.sigma_px;
  return {rig, unsteady(), options};
}

camera::Rig with_extrinsics(const camera::Rig& rig, std::size_t camera, const SE3& T_cam_rig) {
  std::vector<camera::RigCamera> cameras;
  for (std::size_t c = 0; c < rig.size(); ++c) {
    cameras.push_back({rig.camera(c), rig.body_from_cam(c)});
    if (c == camera) cameras.back().T_body_cam = rig.body_from_rig() * T_cam_rig.inverse();
  }
  return camera::Rig(std::move(cameras));
}

// A map of known motion whose camera 1 has the extrinsics `later(time)` from keyframe `from` on, adjusted as if it had
// not.
template <class Later>
map::BundledMap map_of(const camera::Rig& rig, int from, const Later& later) {
  map::SimulatedMap out(simulator(rig));
  out.knows_motion = true;
  for (int i = 0; i < kKeyframes; ++i) {
    out.sim = simulator(i < from ? rig : with_extrinsics(rig, 1, later(kStep_s * i)));
    out.add_keyframe(FrameId(i), kStep_s * i);
  }
  return map::adjusted(out, kFeatures);
}

// From keyframe `from` on, the images of camera 1 were taken `shift_s` later than their stamps say.
map::BundledMap map_with_jump(const camera::Rig& rig, int from, double shift_s) {
  const synthetic::Trajectory trajectory = unsteady();
  const auto T_rig_world = [&](double t) { return (trajectory.T_world_body(t) * rig.body_from_cam(0)).inverse(); };
  return map_of(rig, from,
                [&](double t) { return rig.cam_from_rig(1) * T_rig_world(t + shift_s) * T_rig_world(t).inverse(); });
}

RigRefinement refined(const map::BundledMap& map) { return refine_rig(map, map.rig(), kIndependent, kFeatures); }

TEST(TimeJump, IsFoundWithItsTimeAndItsSign) {
  const camera::Rig rig = synthetic::default_rig();
  for (const double shift_s : {-0.05, 0.02}) {
    const int from = shift_s < 0 ? 15 : 20;
    const map::BundledMap map = map_with_jump(rig, from, shift_s);
    const RigRefinement result = refined(map);
    ASSERT_TRUE(result.done);
    ASSERT_TRUE(result.jump) << shift_s;
    EXPECT_EQ(result.jump->camera, 1u);
    EXPECT_EQ(result.jump->shift_s > 0, shift_s > 0);
    EXPECT_NEAR(to_seconds(result.jump->time_ns - map.keyframe(KeyframeId(0)).frame->time_ns), kStep_s * from,
                1.5 * kStep_s);
  }
}

// An estimate that takes wrong times for extrinsics is not used, and says nothing about the extrinsics.
TEST(TimeJump, LeavesTheCalibrationAsItIs) {
  const RigRefinement result = refined(map_with_jump(synthetic::default_rig(), 15, -0.05));
  ASSERT_TRUE(result.jump);
  EXPECT_TRUE(result.moves.empty());
  EXPECT_FALSE(accepted(result, {.refine = Refine::kTrue}));
  EXPECT_TRUE(deviation_warnings(synthetic::default_rig(), result).empty());
  EXPECT_EQ(
      time_jump_text("right", *result.jump, "4.5 s"),
      "right: from about 4.5 s on, its images seem to have been taken earlier than their time stamps say, compared "
      "with those before: check the time stamps of its images, and whether it lost or repeated some");
}

// The images of a camera are displaced at random, as by electronic stabilisation.
TEST(UnsteadyCamera, IsNamedAndNothingIsRefined) {
  for (const std::size_t cameras : {2u, 4u}) {
    const camera::Rig rig = cameras == 2 ? synthetic::default_rig() : synthetic::ring_rig(4);
    Random random(8, "stabilisation");
    const RigRefinement result = refined(map_of(rig, 0, [&](double) {
      const Eigen::Vector3d turn(random.uniform(-4e-3, 4e-3), random.uniform(-4e-3, 4e-3), 0);
      return SE3(geometry::so3_exp(turn), Eigen::Vector3d::Zero()) * rig.cam_from_rig(1);
    }));
    ASSERT_TRUE(result.done);
    EXPECT_EQ(result.unsteady, 1u) << cameras;
    EXPECT_TRUE(result.moves.empty());
    EXPECT_FALSE(accepted(result, {.refine = Refine::kTrue}));
    EXPECT_TRUE(deviation_warnings(rig, result).empty());
  }
}

TEST(UnsteadyCamera, IsNoneThatIsMovedOrWrongFromTheBeginning) {
  const camera::Rig rig = synthetic::default_rig();
  const SE3 moved = SE3(geometry::so3_exp(Eigen::Vector3d(0.005, 0.005, 0)), Eigen::Vector3d(0.003, 0, 0));
  for (const int from : {0, 10, kKeyframes})
    EXPECT_FALSE(refined(map_of(rig, from, [&](double) { return moved * rig.cam_from_rig(1); })).unsteady) << from;
}

TEST(TimeJump, IsNotTakenForAMove) {
  const camera::Rig rig = synthetic::default_rig();
  constexpr double kDegree = std::numbers::pi / 180;
  for (const Eigen::Vector3d& degrees : {Eigen::Vector3d(0, 0.3, 0), Eigen::Vector3d(0.3, 0, 0.2)}) {
    const SE3 moved = SE3(geometry::so3_exp(kDegree * degrees), Eigen::Vector3d(0.003, 0, 0.002)) * rig.cam_from_rig(1);
    const RigRefinement result = refined(map_of(rig, 15, [&](double) { return moved; }));
    ASSERT_TRUE(result.done);
    EXPECT_FALSE(result.jump);
    EXPECT_EQ(result.moves.size(), 1u);
  }
}

// With everything but the jump constant, the equations have the shift of the images.
TEST(TimeJump, OfKnownPosesHasItsShift) {
  constexpr double kShift_s = 0.01;
  constexpr int kFrom = 12;
  const camera::Rig rig = synthetic::default_rig();
  const map::BundledMap map = map_with_jump(rig, kKeyframes, 0);
  RigProblem problem = choose(map, true, {}, kFeatures);
  const solver::RigValues values = solver::RigValues::of(map.rig().in_frame_of_camera_0());
  // Moves the pixels of the later images of camera 1 by what the velocity of their points in the image says.
  solver::ReprojectionProblem& bundle = problem.selected.problem;
  for (auto& o : bundle.observations) {
    const auto pose = static_cast<std::size_t>(o.pose);
    const KeyframeId k = problem.selected.keyframes[pose];
    if (o.camera.index() != 1 || k.value() < kFrom) continue;
    const SE3 T = values.T_cam_rig[1] * SE3::exp(kShift_s * bundle.twist[pose]) * bundle.T_rig_world[pose];
    const Eigen::Vector3d& point = bundle.points[static_cast<std::size_t>(o.point)];
    const auto before = rig.camera(1).project(values.T_cam_rig[1] * (bundle.T_rig_world[pose] * point)),
               after = rig.camera(1).project(T * point);
    if (before && after) o.pixel += (*after - *before).cast<float>();
  }
  const auto jump = likely_jump(map, problem, values, 1, 0);
  ASSERT_TRUE(jump);
  EXPECT_EQ(jump->time_ns, map.keyframe(KeyframeId(kFrom)).frame->time_ns);
  EXPECT_NEAR(jump->shift_s, kShift_s, 0.1 * kShift_s);
}

}  // namespace
}  // namespace bslam::calibration::jumps
