#include "calibration/lost_observations.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <tuple>
#include <utility>

#include "mapping/simulated_map.h"

namespace bslam::calibration {
namespace {

constexpr feature::FeatureModel kFeatures{.sigma_px = 0.7, .pyramid = {}};

map::SimulatedMap true_map() {
  synthetic::FeatureSimulatorOptions options;
  options.landmarks = 2500;
  options.max_keypoints = 250;
  options.sigma_px = kFeatures.sigma_px;
  map::SimulatedMap out(synthetic::FeatureSimulator(synthetic::default_rig(), synthetic::make_orbit({}), options));
  for (int i = 0; i < 6; ++i) out.add_keyframe(FrameId(i), 0.3 * i);
  return out;
}

adjustment::BundleProblem everything(const map::BundledMap& map) {
  adjustment::Selection selection;
  selection.free_keyframes = map.keyframe_ids();
  selection.landmarks = map.landmark_ids();
  return adjustment::build_problem(map, selection, kFeatures);
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
  adjustment::BundleProblem selected = everything(world.map);
  const auto before = selected.problem.observations;
  const int added = recover_observations(world.map, world.map.rig(), kFeatures, selected);
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
  for (const LandmarkId l : world.map.landmark_ids()) {
    if (world.map.observations(l).size() >= 3 && world.map.observations(l).back().keyframe == KeyframeId(5)) {
      world.map.remove_observation(l, KeyframeId(5));
    }
  }
  adjustment::BundleProblem right = everything(world.map), wrong = right;
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
  adjustment::BundleProblem selected = everything(world.map);
  const std::size_t before = selected.problem.observations.size();
  recover_observations(world.map, world.map.rig(), kFeatures, selected);
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
  for (const LandmarkId l : world.map.landmark_ids()) {
    if (world.map.observations(l).size() >= 3 && world.map.observations(l).back().keyframe == KeyframeId(5)) {
      world.map.remove_observation(l, KeyframeId(5));
    }
  }
  const adjustment::BundleProblem before = everything(world.map);
  adjustment::BundleProblem once = before, selected = before;
  ASSERT_GT(recover_observations(world.map, world.map.rig(), kFeatures, once), 0);
  const auto known = [&](const auto& o) {
    return std::ranges::any_of(before.problem.observations, [&](const auto& b) {
      return b.pose == o.pose && b.camera == o.camera && b.pixel == o.pixel;
    });
  };
  auto given = *std::ranges::find_if_not(once.problem.observations, known);  // a keypoint that would be found
  const int rightful = std::exchange(given.point, given.point == 0 ? 1 : 0);
  selected.problem.observations.push_back(given);
  selected.sources.push_back({selected.landmarks[static_cast<std::size_t>(given.point)],
                              selected.keyframes[static_cast<std::size_t>(given.pose)]});
  recover_observations(world.map, world.map.rig(), kFeatures, selected);
  for (const auto& o : selected.problem.observations) {
    EXPECT_FALSE(o.point == rightful && o.pose == given.pose && o.camera == given.camera && o.pixel == given.pixel);
  }
}

}  // namespace
}  // namespace bslam::calibration
