#include "calibration/rig_problem.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace bslam::calibration {
namespace {

// Observations (point, pose) by camera 0, of four poses in two groups.
RigProblem problem_of(const std::vector<std::pair<int, int>>& observations) {
  RigProblem out;
  out.group = {0, 0, 2, 2};
  out.selected.problem.T_rig_world.resize(4);
  out.selected.problem.pose_free = {false, true, false, true};
  for (const auto& [point, pose] : observations) {
    out.selected.problem.observations.push_back({pose, point, CameraIndex(0), Eigen::Vector2f::Zero(), 1});
    out.selected.sources.push_back({LandmarkId(point), KeyframeId(pose)});
  }
  return out;
}

std::vector<std::pair<int, int>> kept(const RigProblem& problem) {
  std::vector<std::pair<int, int>> out;
  for (const auto& o : problem.selected.problem.observations) out.emplace_back(o.point, o.pose);
  return out;
}

std::vector<bool> free_poses(const RigProblem& problem) {
  return {problem.selected.problem.pose_free.begin(), problem.selected.problem.pose_free.end()};
}

TEST(SeparateGroups, KeepsTheObservationsOfTheGroupWithMost) {
  RigProblem problem = problem_of({{0, 0}, {0, 1}, {0, 2}, {1, 1}, {1, 2}, {1, 3}, {2, 2}, {2, 3}});
  separate_groups(problem);
  EXPECT_EQ(kept(problem), (std::vector<std::pair<int, int>>{{0, 0}, {0, 1}, {1, 2}, {1, 3}, {2, 2}, {2, 3}}));
  EXPECT_EQ(problem.selected.sources[2].landmark, LandmarkId(1));
  EXPECT_EQ(free_poses(problem), (std::vector<bool>{false, true, false, true}));
}

// Otherwise the pose would have no fixed one that it is relative to.
TEST(SeparateGroups, FixesAPoseThatLosesItsConnection) {
  const std::vector<std::pair<int, int>> observations = {{0, 0}, {0, 1}, {0, 2}, {0, 3},
                                                         {0, 3}, {1, 1}, {2, 2}, {2, 3}};
  RigProblem problem = problem_of(observations);
  separate_groups(problem);
  EXPECT_EQ(kept(problem), (std::vector<std::pair<int, int>>{{0, 2}, {0, 3}, {0, 3}, {1, 1}, {2, 2}, {2, 3}}));
  EXPECT_EQ(free_poses(problem), (std::vector<bool>{false, false, false, true}));
  // An observation that is found later connects it again.
  auto& found = problem.selected.problem.observations;
  found.insert(found.begin() + 3, {0, 1, CameraIndex(0), Eigen::Vector2f::Zero(), 1});
  problem.selected.sources.resize(found.size());
  separate_groups(problem);
  EXPECT_EQ(free_poses(problem), (std::vector<bool>{false, true, false, true}));
}

}  // namespace
}  // namespace bslam::calibration
