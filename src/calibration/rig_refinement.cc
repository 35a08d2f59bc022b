#include "calibration/rig_refinement.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "adjustment/flat_problem.h"
#include "calibration/lost_observations.h"
#include "solver/rig_adjuster.h"
#include "solver/rig_equations.h"

namespace bslam::calibration {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kMillimetres = 1000.0;
constexpr std::size_t kStretch = 10;  // keyframes in a row, so that those chosen share landmarks
constexpr int kPasses = 4;            // at most; each finds anew what the extrinsics before it had refused
constexpr int kMinShared = 15;        // landmarks two keyframes share, below which one does not hold the other

// All keyframes, or stretches of them with even gaps; in order of id.
std::vector<KeyframeId> choose_keyframes(const map::BundledMap& map, std::size_t limit) {
  const std::vector<KeyframeId> all = map.keyframe_ids();
  if (all.size() <= limit) return all;
  const std::size_t stretches = std::max<std::size_t>(1, limit / kStretch);
  std::vector<KeyframeId> out;
  for (std::size_t s = 0; s < stretches; ++s) {
    const std::size_t first = stretches == 1 ? 0 : s * (all.size() - kStretch) / (stretches - 1);
    for (std::size_t k = first; k < std::min(first + kStretch, all.size()); ++k) out.push_back(all[k]);
  }
  return out;
}

// A landmark as a candidate: in how many chosen keyframes, from which stretch on, by which cameras it is seen.
struct Candidate {
  int keyframes = 0;
  std::size_t stretch = 0;
  std::vector<std::uint8_t> cameras;
};

Candidate look_up(const map::BundledMap& map, LandmarkId landmark, const std::vector<int>& position) {
  Candidate out;
  out.cameras.assign(map.rig().size(), 0);
  for (const map::Observation& o : map.observations(landmark)) {
    const int at = position[o.keyframe.index()];
    if (at < 0) continue;
    if (out.keyframes++ == 0) out.stretch = static_cast<std::size_t>(at) / kStretch;
    for (const frame::KeypointRef r : map.keyframe(o.keyframe).frame->bundled.keypoints(o.feature))
      out.cameras[r.camera.index()] = 1;
  }
  return out;
}

std::vector<int> positions(const map::BundledMap& map, const std::vector<KeyframeId>& keyframes) {
  std::vector<int> out(map.keyframe_slots(), -1);
  for (std::size_t i = 0; i < keyframes.size(); ++i) out[keyframes[i].index()] = static_cast<int>(i);
  return out;
}

// Every stretch and camera in turn gives the landmark that most keyframes see; in order of id.
std::vector<LandmarkId> choose_landmarks(const map::BundledMap& map, const std::vector<KeyframeId>& keyframes,
                                         std::size_t limit) {
  const std::vector<int> position = positions(map, keyframes);
  const std::size_t stretches = (keyframes.size() + kStretch - 1) / kStretch, cameras = map.rig().size();
  std::vector<std::vector<std::pair<int, LandmarkId>>> queues(stretches * cameras);  // fewer keyframes, to sort by
  for (const LandmarkId l : map.landmark_ids()) {
    const Candidate candidate = look_up(map, l, position);
    if (candidate.keyframes < 2) continue;
    for (std::size_t c = 0; c < cameras; ++c) {
      if (candidate.cameras[c] != 0) queues[candidate.stretch * cameras + c].emplace_back(-candidate.keyframes, l);
    }
  }
  for (auto& queue : queues) std::sort(queue.begin(), queue.end());
  std::vector<std::uint8_t> taken(map.landmark_slots(), 0);
  std::vector<std::size_t> next(queues.size(), 0);
  std::vector<LandmarkId> out;
  for (bool any = true; any && out.size() < limit;) {
    any = false;
    for (std::size_t q = 0; q < queues.size() && out.size() < limit; ++q) {
      while (next[q] < queues[q].size() && taken[queues[q][next[q]].second.index()] != 0) ++next[q];
      if (next[q] == queues[q].size()) continue;
      const LandmarkId l = queues[q][next[q]++].second;
      taken[l.index()] = 1;
      out.push_back(l);
      any = true;
    }
  }
  std::sort(out.begin(), out.end());
  return out;
}

// Representative of each keyframe's group: keyframes that hold one another by shared landmarks, directly or by others.
// It is the first of the group.
std::vector<std::size_t> groups(const map::BundledMap& map, const std::vector<KeyframeId>& keyframes,
                                const std::vector<LandmarkId>& landmarks) {
  const std::vector<int> position = positions(map, keyframes);
  const std::size_t n = keyframes.size();
  std::vector<int> shared(n * n, 0);
  std::vector<std::size_t> seen;
  for (const LandmarkId l : landmarks) {
    seen.clear();
    for (const map::Observation& o : map.observations(l)) {
      if (position[o.keyframe.index()] >= 0) seen.push_back(static_cast<std::size_t>(position[o.keyframe.index()]));
    }
    for (const std::size_t a : seen) {
      for (const std::size_t b : seen) ++shared[a * n + b];
    }
  }
  std::vector<std::size_t> group(n);
  std::iota(group.begin(), group.end(), 0u);
  for (std::size_t a = 0; a < n; ++a) {
    for (std::size_t b = a + 1; b < n; ++b) {
      if (shared[a * n + b] < kMinShared || group[a] == group[b]) continue;
      const std::size_t kept = std::min(group[a], group[b]), gone = std::max(group[a], group[b]);
      std::replace(group.begin(), group.end(), gone, kept);
    }
  }
  return group;
}

// Part of the map as a flat problem, and the group of each of its poses.
struct RigProblem {
  adjustment::FlatProblem flat;
  std::vector<std::size_t> group;
};

// Each group floats on its own: one keyframe of it is held, which takes nothing from what its others say about the rig.
RigProblem choose(const map::BundledMap& map, const RigRefinementOptions& options,
                  const feature::FeatureModel& features) {
  adjustment::Selection selection;
  const std::vector<KeyframeId> keyframes = choose_keyframes(map, static_cast<std::size_t>(options.keyframes));
  selection.landmarks = choose_landmarks(map, keyframes, static_cast<std::size_t>(options.landmarks));
  RigProblem out{{}, groups(map, keyframes, selection.landmarks)};
  for (std::size_t i = 0; i < keyframes.size(); ++i) {
    (out.group[i] == i ? selection.fixed_keyframes : selection.free_keyframes).push_back(keyframes[i]);
  }
  out.flat = adjustment::flatten(map, selection, features);
  return out;
}

// Observations of a point by other groups than that of most (ties: the first) go: two held keyframes tied to each other
// would tell lengths, which is for the extrinsics to tell.
void part_groups(RigProblem& problem) {
  std::vector<solver::ReprojectionProblem::Observation>& observations = problem.flat.problem.observations;
  std::vector<int> count(problem.group.size());
  std::size_t kept = 0;
  for (std::size_t begin = 0, end = 0; begin < observations.size(); begin = end) {
    std::fill(count.begin(), count.end(), 0);
    const auto group_of = [&](std::size_t o) { return problem.group[static_cast<std::size_t>(observations[o].pose)]; };
    for (; end < observations.size() && observations[end].point == observations[begin].point; ++end)
      ++count[group_of(end)];
    const auto most = static_cast<std::size_t>(std::max_element(count.begin(), count.end()) - count.begin());
    for (std::size_t o = begin; o < end; ++o) {
      if (group_of(o) != most) continue;
      problem.flat.sources[kept] = problem.flat.sources[o];
      observations[kept++] = observations[o];
    }
  }
  observations.resize(kept);
  problem.flat.sources.resize(kept);
}

// Root of the largest eigenvalue.
double worst_deviation(const Matrix3d& covariance) {
  return std::sqrt(
      Eigen::SelfAdjointEigenSolver<Matrix3d>(covariance, Eigen::EigenvaluesOnly).eigenvalues().maxCoeff());
}

double in_sigmas(const Vector3d& change, const Matrix3d& covariance) {
  return std::sqrt(change.dot(covariance.llt().solve(change)));
}

CameraRefinement judge(const solver::ExtrinsicEstimate& estimate, const RigRefinementOptions& options) {
  CameraRefinement out;
  out.T_cam_rig_after = estimate.T_cam_rig;
  out.observed = estimate.observed;
  out.observations = estimate.observations;
  const Vector3d turned = estimate.change.head<3>(), moved = estimate.change.tail<3>();
  const Matrix3d of_rotation = estimate.covariance.topLeftCorner<3, 3>(),
                 of_translation = estimate.covariance.bottomRightCorner<3, 3>();
  out.change_deg = geometry::degrees(turned.norm());
  out.change_mm = moved.norm() * kMillimetres;
  out.std_deg = geometry::degrees(worst_deviation(of_rotation));
  out.std_mm = worst_deviation(of_translation) * kMillimetres;
  out.rotation_sigmas = in_sigmas(turned, of_rotation);
  out.translation_sigmas = in_sigmas(moved, of_translation);
  out.suspect = (out.rotation_sigmas > options.suspect_sigmas && out.change_deg > options.suspect_deg) ||
                (out.translation_sigmas > options.suspect_sigmas && out.change_mm > options.suspect_mm);
  return out;
}

// Have no extrinsics moved from `before` by more than their own uncertainty?
bool settled(const solver::RigAdjustment& adjusted, const std::vector<geometry::SE3>& before) {
  for (std::size_t c = 1; c < before.size(); ++c) {
    const geometry::Vector6d moved = solver::extrinsic_change(adjusted.cameras[c].T_cam_rig, before[c]);
    if (moved.dot(adjusted.cameras[c].covariance.llt().solve(moved)) > static_cast<double>(moved.size())) return false;
  }
  return true;
}

// A map made with wrong extrinsics has kept those observations that fit them, and adjusting it stops short of the
// truth. So what was refused is looked for again under the extrinsics found.
solver::RigAdjustment adjust_in_passes(const map::BundledMap& map, const feature::FeatureModel& features,
                                       const solver::RigAdjusterOptions& options, RigProblem& problem,
                                       const std::stop_token& stop) {
  std::vector<geometry::SE3> T_cam_rig;
  for (std::size_t c = 0; c < map.rig().size(); ++c) T_cam_rig.push_back(map.rig().cam_from_rig(c));
  part_groups(problem);
  solver::RigAdjustment out = solver::adjust_rig(problem.flat.problem, options, T_cam_rig, stop);
  for (int pass = 1; pass < kPasses && out.done && !settled(out, T_cam_rig); ++pass) {
    for (std::size_t c = 0; c < T_cam_rig.size(); ++c) T_cam_rig[c] = out.cameras[c].T_cam_rig;
    if (recover_observations(map, T_cam_rig, features, problem.flat) == 0) break;
    part_groups(problem);
    solver::RigAdjustment again = solver::adjust_rig(problem.flat.problem, options, T_cam_rig, stop);
    if (!again.done) break;
    out = std::move(again);
  }
  return out;
}

}  // namespace

RigRefinement refine_rig(const map::BundledMap& map, const RigRefinementOptions& options,
                         const feature::FeatureModel& features, std::stop_token stop) {
  RigRefinement out;
  // Where the map has no metric scale, millimetres of the calibration mean nothing in it.
  if (map.rig().size() < 2 || map.num_keyframes() == 0 || map.scale() != map::Scale::kMetric) return out;
  RigProblem problem = choose(map, options, features);
  out.keyframes = problem.flat.keyframes.size();
  out.landmarks = problem.flat.landmarks.size();
  const solver::RigAdjusterOptions solve{.sigma_rotation = geometry::radians(options.calibration_deg),
                                         .sigma_translation = options.calibration_mm / kMillimetres};
  const solver::RigAdjustment adjusted = adjust_in_passes(map, features, solve, problem, stop);
  if (!adjusted.done) return out;
  out.done = true;
  CameraRefinement& first = out.cameras.emplace_back();
  first.observed = adjusted.cameras.front().observed;
  first.observations = adjusted.cameras.front().observations;
  for (std::size_t c = 1; c < map.rig().size(); ++c) {
    out.cameras.push_back(judge(adjusted.cameras[c], options));
  }
  return out;
}

camera::Rig refined(const camera::Rig& rig, const RigRefinement& refinement) {
  if (!refinement.done) return rig;
  std::vector<camera::RigCamera> cameras;
  for (std::size_t c = 0; c < rig.size(); ++c) {
    const geometry::SE3 T_body_cam =
        c == 0 ? rig.body_from_cam(0) : rig.body_from_cam(0) * refinement.cameras[c].T_cam_rig_after.inverse();
    cameras.push_back({rig.camera(c), T_body_cam});
  }
  return camera::Rig(std::move(cameras));
}

}  // namespace bslam::calibration
