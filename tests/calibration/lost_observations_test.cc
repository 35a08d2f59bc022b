#include "calibration/lost_observations.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <tuple>
#include <utility>

#include "mapping/simulated_map.h"

namespace bslam::calibration {
namespace {

constexpr feature::FeatureModel kFeatures{.sigma_px = 0.7, .pyramid = {}};

// `late_s`: per camera, by how much its images are later than their time stamps say; empty: not at all.
map::SimulatedMap true_map(std::vector<double> late_s = {}) {
  synthetic::FeatureSimulatorOptions options;
  options.landmarks = 2500;
  options.max_keypoints = 250;
  options.sigma_px = kFeatures.sigma_px;
  options.capture_offset_s = std::move(late_s);
  map::SimulatedMap out(synthetic::FeatureSimulator(synthetic::default_rig(), synthetic::make_orbit({}), options));
  out.knows_motion = true;
  out.change_frame = [](frame::BundledFrame& frame) {
    for (frame::CameraFrame& camera : frame.cameras) camera.time_ns = frame.time_ns;
  };
  for (int i = 0; i < 6; ++i) out.add_keyframe(FrameId(i), 0.3 * i);
  return out;
}

// All keyframes, in one group.
RigProblem everything(const map::BundledMap& map) {
  adjustment::Selection selection;
  selection.free_keyframes = map.keyframe_ids();
  selection.landmarks = map.landmark_ids();
  RigProblem out{adjustment::build_problem(map, selection, kFeatures), {}};
  out.group.assign(out.selected.keyframes.size(), 0);
  return out;
}

// Removes the observations of a keyframe of landmarks that at least two others observe.
void reject_observations(KeyframeId keyframe, map::BundledMap& map) {
  for (const LandmarkId l : map.landmark_ids()) {
    if (map.observations(l).size() >= 3) map.remove_observation(l, keyframe);
  }
}

TEST(RecoverObservations, RecoversRejectedKeypointsWithFewErrors) {
  map::SimulatedMap world = true_map();
  const KeyframeId last(5);
  std::size_t rejected = 0;  // keypoints of every second landmark of the last keyframe that two others see
  for (const LandmarkId l : world.map.landmark_ids()) {
    const auto observations = world.map.observations(l);
    if (l.value() % 2 != 0 || observations.size() < 3 || observations.back().keyframe != last) continue;
    rejected += world.map.keyframe(last).frame->bundled.keypoints(observations.back().feature).size();
    ASSERT_TRUE(world.map.remove_observation(l, last));
  }
  ASSERT_GT(rejected, 60u);
  RigProblem problem = everything(world.map);
  const adjustment::BundleProblem& selected = problem.selected;
  const auto before = selected.problem.observations;
  const int added = recover_observations(world.map, world.map.rig(), kFeatures, problem);
  EXPECT_GT(added, 0.8 * static_cast<double>(rejected));
  ASSERT_EQ(selected.problem.observations.size(), before.size() + static_cast<std::size_t>(added));
  ASSERT_EQ(selected.sources.size(), selected.problem.observations.size());
  int right = 0, new_ones = 0;
  for (std::size_t i = 0, old = 0; i < selected.problem.observations.size(); ++i) {
    const auto& o = selected.problem.observations[i];
    if (i > 0) {  // sorted, and no point is observed twice in an image
      const auto& p = selected.problem.observations[i - 1];
      EXPECT_LT(std::tuple(p.point, p.pose, p.camera), std::tuple(o.point, o.pose, o.camera));
    }
    const LandmarkId l = selected.landmarks[static_cast<std::size_t>(o.point)];
    EXPECT_EQ(selected.sources[i].landmark, l);
    EXPECT_EQ(selected.sources[i].keyframe, selected.keyframes[static_cast<std::size_t>(o.pose)]);
    if (old < before.size() && before[old].pose == o.pose && before[old].point == o.point &&
        before[old].camera == o.camera) {
      ++old;
      continue;
    }
    ++new_ones;
    const map::SimulatedFrame& frame = world.frames[selected.sources[i].keyframe.index()];
    const auto& pixels = frame.frame.keypoints(o.camera).pixel;
    const auto k = static_cast<std::size_t>(std::find(pixels.begin(), pixels.end(), o.pixel) - pixels.begin());
    right += frame.landmark[o.camera.index()][k] == world.truth_of_landmark.at(l.value());
  }
  EXPECT_EQ(new_ones, added);
  EXPECT_GT(right, 0.97 * added);
}

TEST(RecoverObservations, UsesTheGivenExtrinsics) {
  map::SimulatedMap world = true_map();
  reject_observations(KeyframeId(5), world.map);
  RigProblem right = everything(world.map), wrong = right;
  const camera::Rig& truth = world.map.rig();
  const int found = recover_observations(world.map, truth, kFeatures, right);
  geometry::Vector6d off;
  off << 0.05, 0.05, 0, 0, 0, 0;
  solver::RigValues turned = solver::RigValues::of(truth);
  for (std::size_t c = 1; c < truth.size(); ++c) turned.T_cam_rig[c] = turned.T_cam_rig[c].perturbed(off);
  const int found_wrongly = recover_observations(world.map, turned.applied_to(truth), kFeatures, wrong);
  EXPECT_GT(found, 100);
  EXPECT_LT(found_wrongly, found / 2);
}

TEST(RecoverObservations, UsesNoKeypointWithALandmark) {
  const map::SimulatedMap world = true_map();
  RigProblem problem = everything(world.map);
  const adjustment::BundleProblem& selected = problem.selected;
  const std::size_t before = selected.problem.observations.size();
  recover_observations(world.map, world.map.rig(), kFeatures, problem);
  for (std::size_t i = 0; i < selected.problem.observations.size(); ++i) {
    const auto& o = selected.problem.observations[i];
    const KeyframeId k = selected.sources[i].keyframe;
    const auto& pixels = world.map.keypoints(k, o.camera).pixel;
    const auto at = static_cast<std::size_t>(std::find(pixels.begin(), pixels.end(), o.pixel) - pixels.begin());
    const LandmarkId there =
        world.map.landmark_of(k, world.map.keyframe(k).frame->bundled.feature(o.camera, KeypointIndex(at)));
    EXPECT_TRUE(!there.valid() || there == selected.sources[i].landmark);
  }
  EXPECT_LT(selected.problem.observations.size(), before + before / 20);
}

TEST(RecoverObservations, UsesNoKeypointOfAnotherPointOfTheProblem) {
  map::SimulatedMap world = true_map();
  reject_observations(KeyframeId(5), world.map);
  const RigProblem before = everything(world.map);
  RigProblem once = before, problem = before;
  adjustment::BundleProblem& selected = problem.selected;
  ASSERT_GT(recover_observations(world.map, world.map.rig(), kFeatures, once), 0);
  const auto known = [&](const auto& o) {
    return std::ranges::any_of(before.selected.problem.observations, [&](const auto& b) {
      return b.pose == o.pose && b.camera == o.camera && b.pixel == o.pixel;
    });
  };
  auto given = *std::ranges::find_if_not(once.selected.problem.observations, known);  // a keypoint that would be found
  const int rightful = std::exchange(given.point, given.point == 0 ? 1 : 0);
  selected.problem.observations.push_back(given);
  selected.sources.push_back({selected.landmarks[static_cast<std::size_t>(given.point)],
                              selected.keyframes[static_cast<std::size_t>(given.pose)]});
  recover_observations(world.map, world.map.rig(), kFeatures, problem);
  for (const auto& o : selected.problem.observations) {
    EXPECT_FALSE(o.point == rightful && o.pose == given.pose && o.camera == given.camera && o.pixel == given.pixel);
  }
}

// The images of a camera are later than their time stamps say. Its keypoints are where its time offset predicts them.
TEST(RecoverObservations, UsesTheTimeOffsets) {
  constexpr double kLate_s = 0.06;
  constexpr std::size_t kCamera = 1;
  map::SimulatedMap world = true_map({0, kLate_s, 0, 0});
  reject_observations(KeyframeId(5), world.map);
  RigProblem stamped = everything(world.map);
  for (const KeyframeId k : stamped.selected.keyframes)
    stamped.selected.problem.twist.push_back(world.map.keyframe(k).twist);
  RigProblem late = stamped;
  solver::RigValues values = solver::RigValues::of(world.map.rig());
  values.timing[kCamera].shift_s = kLate_s;
  const auto of_camera = [](const RigProblem& problem) {
    return std::ranges::count(problem.selected.problem.observations, CameraIndex(kCamera),
                              &solver::ReprojectionProblem::Observation::camera);
  };
  const auto before = of_camera(stamped);
  recover_observations(world.map, world.map.rig(), kFeatures, stamped);
  recover_observations(world.map, values.applied_to(world.map.rig()), kFeatures, late);
  EXPECT_GT(of_camera(late), before + 30);
  EXPECT_LT(of_camera(stamped) - before, (of_camera(late) - before) / 2);
}

// Keyframes of another group are not where these are relative to the points.
TEST(RecoverObservations, SearchesOnlyKeyframesOfTheSameGroup) {
  map::SimulatedMap world = true_map();
  reject_observations(KeyframeId(5), world.map);
  RigProblem problem = everything(world.map);
  std::erase_if(problem.selected.problem.observations, [](const auto& o) { return o.pose == 5; });
  problem.selected.sources.resize(problem.selected.problem.observations.size());
  RigProblem apart = problem;
  apart.group.back() = 5;
  const auto in_last = [](const RigProblem& p) {
    return std::ranges::count(p.selected.problem.observations, 5, &solver::ReprojectionProblem::Observation::pose);
  };
  recover_observations(world.map, world.map.rig(), kFeatures, problem);
  EXPECT_GT(in_last(problem), 100);
  recover_observations(world.map, world.map.rig(), kFeatures, apart);
  EXPECT_EQ(in_last(apart), 0);
}

}  // namespace
}  // namespace bslam::calibration
