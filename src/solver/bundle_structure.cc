#include "solver/bundle_structure.h"

#include "base/assert.h"

namespace bslam::solver {
namespace {

using Observation = ReprojectionProblem::Observation;

// Terms, groups and points; the slots of poses are not set yet.
void gather(const ReprojectionProblem& problem, const std::vector<double>& chi2, std::span<const std::uint8_t> skip,
            BundleStructure& out) {
  const auto& observations = problem.observations;
  for (std::size_t begin = 0, end = 0; begin < observations.size(); begin = end) {
    const BundleStructure::Point point{observations[begin].point, out.groups.size(), 0};
    const std::size_t first_term = out.terms.size();
    for (; end < observations.size() && observations[end].point == point.point; ++end) {
      const Observation& o = observations[end];
      if ((!skip.empty() && skip[end] != 0) || !(chi2[end] < kMaxChi2)) continue;
      if (out.groups.size() == point.first_group || out.groups.back().pose != o.pose) {
        out.groups.push_back({o.pose, -1, out.terms.size()});
      }
      out.terms.push_back({o.pixel, 1.0f / o.sigma, o.camera.value()});
    }
    if (out.terms.size() - first_term >= 2) {
      out.points.push_back(point);
    } else {
      out.terms.resize(first_term);
      out.groups.resize(point.first_group);
    }
  }
  out.points.push_back({-1, out.groups.size(), 0});
  out.groups.push_back({-1, -1, out.terms.size()});
}

void assign_slots(const ReprojectionProblem& problem, BundleStructure& out) {
  std::vector<std::uint8_t> seen(problem.T_rig_world.size(), 0);
  for (std::size_t g = 0; g + 1 < out.groups.size(); ++g) seen[static_cast<std::size_t>(out.groups[g].pose)] = 1;
  std::vector<int> slot(seen.size(), -1);
  for (std::size_t p = 0; p < seen.size(); ++p) {
    if (seen[p] == 0 || problem.pose_free[p] == 0) continue;
    slot[p] = static_cast<int>(out.pose_of_slot.size());
    out.pose_of_slot.push_back(static_cast<int>(p));
  }
  out.frame_sizes.assign(out.pose_of_slot.size(), 6);
  for (std::size_t g = 0; g + 1 < out.groups.size(); ++g) {
    out.groups[g].slot = slot[static_cast<std::size_t>(out.groups[g].pose)];
  }
}

// Calls visit(slot of a, slot of b) for each pair of free groups of a point, b <= a.
template <class Visit>
void for_each_pair(const BundleStructure& s, std::size_t point, const Visit& visit) {
  const std::size_t begin = s.points[point].first_group, end = s.points[point + 1].first_group;
  for (std::size_t a = begin; a < end; ++a) {
    if (s.groups[a].slot < 0) continue;
    for (std::size_t b = begin; b <= a; ++b) {
      if (s.groups[b].slot >= 0) visit(s.groups[a].slot, s.groups[b].slot);
    }
  }
}

void number_pairs(BundleStructure& s) {
  s.pattern = matrix::BlockPattern(static_cast<int>(s.pose_of_slot.size()));
  for (std::size_t i = 0; i < s.num_points(); ++i) {
    for_each_pair(s, i, [&](int a, int b) { s.pattern.mark(a, b); });
  }
  s.pattern.number();
  for (std::size_t i = 0; i < s.num_points(); ++i) {
    s.points[i].first_pair = s.pair_block.size();
    for_each_pair(s, i, [&](int a, int b) { s.pair_block.push_back(s.pattern.index(a, b)); });
  }
}

}  // namespace

BundleStructure make_structure(const ReprojectionProblem& problem, const std::vector<double>& chi2,
                               std::span<const std::uint8_t> skip) {
  check_problem(problem);
  BSLAM_ASSERT(chi2.size() == problem.observations.size(), "there must be one squared error per observation");
  BSLAM_ASSERT(skip.empty() || skip.size() == problem.observations.size(), "skip must have one entry per observation");
  BundleStructure out;
  out.terms.reserve(problem.observations.size());
  out.groups.reserve(problem.observations.size() + 1);
  out.points.reserve(problem.points.size() + 1);
  gather(problem, chi2, skip, out);
  assign_slots(problem, out);
  number_pairs(out);
  return out;
}

}  // namespace bslam::solver
