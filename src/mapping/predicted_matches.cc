#include "mapping/predicted_matches.h"

#include <algorithm>
#include <span>
#include <utility>
#include <vector>

namespace bslam::mapping {
namespace {

using Observation = solver::ReprojectionProblem::Observation;

// Assigns to each camera of `group` the smallest camera that is connected to it by observations at one pose.
// `observations` belong to one point and are sorted by pose.
void connect_cameras(std::span<const Observation> observations, std::vector<std::size_t>& group) {
  for (std::size_t c = 0; c < group.size(); ++c) group[c] = c;
  for (std::size_t i = 1; i < observations.size(); ++i) {
    if (observations[i].pose != observations[i - 1].pose) continue;
    const std::size_t a = group[observations[i - 1].camera.index()], b = group[observations[i].camera.index()];
    std::ranges::replace(group, std::max(a, b), std::min(a, b));
  }
}

}  // namespace

solver::ReprojectionProblem without_predicted_matches(solver::ReprojectionProblem problem) {
  const std::vector<Observation> all = std::exchange(problem.observations, {});
  const std::vector<geometry::Vector3d> points = std::exchange(problem.points, {});
  std::vector<std::size_t> group(problem.rig->size());
  std::vector<Observation> of_point;
  for (auto begin = all.begin(); begin != all.end();) {
    const auto end = std::find_if(begin, all.end(), [&](const Observation& o) { return o.point != begin->point; });
    connect_cameras({begin, end}, group);
    const auto group_of = [&](const Observation& o) { return group[o.camera.index()]; };
    of_point.assign(begin, end);
    std::ranges::stable_sort(of_point, {}, group_of);
    for (auto first = of_point.begin(); first != of_point.end();) {
      const auto last =
          std::find_if(first, of_point.end(), [&](const Observation& o) { return group_of(o) != group_of(*first); });
      if (last - first > 1) {
        for (auto o = first; o != last; ++o) o->point = static_cast<int>(problem.points.size());
        problem.points.push_back(points[static_cast<std::size_t>(begin->point)]);
        problem.observations.insert(problem.observations.end(), first, last);
      }
      first = last;
    }
    begin = end;
  }
  return problem;
}

}  // namespace bslam::mapping
