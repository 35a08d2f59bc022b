#include "calibration/rig_problem.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "base/disjoint_sets.h"

namespace bslam::calibration {
namespace {

// Number of consecutive keyframes in a segment. The keyframes of a short segment share landmarks. A long segment
// contains turns and loops, which determine the focal length; a straight path hardly does.
constexpr std::size_t kShortSegment = 10, kLongSegment = 100;
constexpr int kMinShared = 15;  // minimum number of shared landmarks for one keyframe to constrain another

// Returns true if the velocity of a keyframe is known. Otherwise cameras with other capture times and rolling shutters
// are modelled at wrong positions.
bool motion_known(const map::BundledMap& map, KeyframeId k) { return !map.keyframe(k).twist.isZero(0); }

// The keyframes that can be used, in order of id. `timing`: the timing of the cameras is estimated.
std::vector<KeyframeId> usable_keyframes(const map::BundledMap& map, bool timing) {
  std::vector<KeyframeId> out = map.keyframe_ids();
  std::erase_if(out, [&](KeyframeId k) {
    return !motion_known(map, k) && (timing || frame::depends_on_motion(map.rig(), *map.keyframe(k).frame));
  });
  return out;
}

// Returns all of these keyframes, or evenly spaced segments of consecutive ones if there are more than `limit`.
std::vector<KeyframeId> choose_keyframes(const std::vector<KeyframeId>& all, std::size_t limit) {
  if (all.size() <= limit) return all;
  const std::size_t length = std::clamp(limit / 10, kShortSegment, kLongSegment);
  const std::size_t segments = std::max<std::size_t>(1, limit / length);
  std::vector<KeyframeId> out;
  for (std::size_t s = 0; s < segments; ++s) {
    const std::size_t first = segments == 1 ? 0 : s * (all.size() - length) / (segments - 1);
    for (std::size_t k = first; k < std::min(first + length, all.size()); ++k) out.push_back(all[k]);
  }
  return out;
}

// Observations of a landmark: the number of chosen keyframes, the first segment, and the cameras that observe it.
struct Candidate {
  int keyframes = 0;
  std::size_t segment = 0;
  std::vector<std::uint8_t> cameras;
};

Candidate look_up(const map::BundledMap& map, LandmarkId landmark, const std::vector<int>& position) {
  Candidate out;
  out.cameras.assign(map.rig().size(), 0);
  for (const map::Observation& o : map.observations(landmark)) {
    const int at = position[o.keyframe.index()];
    if (at < 0) continue;
    if (out.keyframes++ == 0) out.segment = static_cast<std::size_t>(at) / kShortSegment;
    for (const frame::KeypointRef r : map.keyframe(o.keyframe).frame->bundled.keypoints(o.feature))
      out.cameras[r.camera.index()] = 1;
  }
  return out;
}

// Segments and cameras alternate in choosing the landmark observed by the most keyframes; the result is in order of
// id.
std::vector<LandmarkId> choose_landmarks(const map::BundledMap& map, const std::vector<KeyframeId>& keyframes,
                                         std::size_t limit) {
  const std::vector<int> position = adjustment::index_by_keyframe(map, keyframes);
  const std::size_t segments = (keyframes.size() + kShortSegment - 1) / kShortSegment, cameras = map.rig().size();
  // negated number of keyframes, so that sorting puts the largest first
  std::vector<std::vector<std::pair<int, LandmarkId>>> queues(segments * cameras);
  for (const LandmarkId l : map.landmark_ids()) {
    const Candidate candidate = look_up(map, l, position);
    if (candidate.keyframes < 2) continue;
    for (std::size_t c = 0; c < cameras; ++c) {
      if (candidate.cameras[c] != 0) queues[candidate.segment * cameras + c].emplace_back(-candidate.keyframes, l);
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

// The chosen keyframes that observe each landmark, by position, and the landmarks that each of them observes.
struct Sightings {
  std::vector<std::vector<std::size_t>> keyframes_of_landmark, landmarks_of_keyframe;
};

Sightings sightings(const map::BundledMap& map, const std::vector<KeyframeId>& keyframes,
                    const std::vector<LandmarkId>& landmarks) {
  const std::vector<int> position = adjustment::index_by_keyframe(map, keyframes);
  Sightings out{std::vector<std::vector<std::size_t>>(landmarks.size()),
                std::vector<std::vector<std::size_t>>(keyframes.size())};
  for (std::size_t l = 0; l < landmarks.size(); ++l) {
    for (const map::Observation& o : map.observations(landmarks[l])) {
      if (position[o.keyframe.index()] < 0) continue;
      const auto at = static_cast<std::size_t>(position[o.keyframe.index()]);
      out.keyframes_of_landmark[l].push_back(at);
      out.landmarks_of_keyframe[at].push_back(l);
    }
  }
  return out;
}

// Assigns each keyframe to a group of keyframes connected, directly or indirectly, by shared landmarks. Returns, per
// keyframe, the index of the first keyframe of its group.
std::vector<std::size_t> groups(const map::BundledMap& map, const std::vector<KeyframeId>& keyframes,
                                const std::vector<LandmarkId>& landmarks) {
  const Sightings seen = sightings(map, keyframes, landmarks);
  DisjointSets sets(keyframes.size());
  std::vector<int> shared(keyframes.size());
  for (std::size_t a = 0; a < keyframes.size(); ++a) {
    std::fill(shared.begin(), shared.end(), 0);
    for (const std::size_t l : seen.landmarks_of_keyframe[a]) {
      for (const std::size_t b : seen.keyframes_of_landmark[l]) ++shared[b];
    }
    for (std::size_t b = a + 1; b < keyframes.size(); ++b) {
      if (shared[b] >= kMinShared) sets.join(a, b);
    }
  }
  std::vector<std::size_t> group(keyframes.size());
  for (std::size_t k = 0; k < group.size(); ++k) group[k] = sets.root(k);
  return group;
}

// Fixes one pose of each group, and one of every part that observations no longer connect to it.
void fix_one_of_each_part(RigProblem& problem) {
  solver::ReprojectionProblem& bundle = problem.selected.problem;
  const std::size_t poses = problem.group.size();
  DisjointSets parts(poses);
  std::vector<std::uint8_t> observed(poses, 0), has_fixed(poses, 0);
  for (std::size_t o = 0; o < bundle.observations.size(); ++o) {
    const auto pose = static_cast<std::size_t>(bundle.observations[o].pose);
    observed[pose] = 1;
    if (o > 0 && bundle.observations[o - 1].point == bundle.observations[o].point)
      parts.join(pose, static_cast<std::size_t>(bundle.observations[o - 1].pose));
  }
  for (std::size_t pose = 0; pose < poses; ++pose) {
    bundle.pose_free[pose] = problem.group[pose] != pose;
    if (!bundle.pose_free[pose]) has_fixed[parts.root(pose)] = 1;
  }
  for (std::size_t pose = 0; pose < poses; ++pose) {
    if (observed[pose] == 0 || std::exchange(has_fixed[parts.root(pose)], std::uint8_t{1}) != 0) continue;
    bundle.pose_free[pose] = false;
  }
}

}  // namespace

RigProblem choose(const map::BundledMap& map, bool timing, const CalibrationOptions& options,
                  const feature::FeatureModel& features) {
  adjustment::Selection selection;
  const std::vector<KeyframeId> keyframes =
      choose_keyframes(usable_keyframes(map, timing), static_cast<std::size_t>(options.keyframes));
  selection.landmarks = choose_landmarks(map, keyframes, static_cast<std::size_t>(options.landmarks));
  RigProblem out{{}, groups(map, keyframes, selection.landmarks)};
  for (std::size_t i = 0; i < keyframes.size(); ++i) {
    (out.group[i] == i ? selection.fixed_keyframes : selection.free_keyframes).push_back(keyframes[i]);
  }
  out.selected = adjustment::build_problem(map, selection, features);
  if (!map.rig().moves().empty())
    out.selected.problem.motion = adjustment::motions_without_moves(map, out.selected.keyframes);
  const geometry::SE3 &T_cam0_rig = map.rig().cam_from_rig(0), &T_rig_cam0 = map.rig().rig_from_cam(0);
  for (geometry::SE3& T_cam0_world : out.selected.problem.T_rig_world) T_cam0_world = T_cam0_rig * T_cam0_world;
  for (geometry::SE3& motion : out.selected.problem.motion) motion = T_cam0_rig * motion * T_rig_cam0;
  if (!timing && out.selected.problem.twist.empty()) return out;  // no camera has a rolling shutter
  out.selected.problem.twist.clear();
  const Eigen::Matrix3d R_cam0_rig = T_cam0_rig.matrix3();
  for (const KeyframeId k : out.selected.keyframes) {
    geometry::Vector6d twist = map.keyframe(k).twist;
    twist << R_cam0_rig * twist.head<3>(), R_cam0_rig * twist.tail<3>();
    out.selected.problem.twist.push_back(twist);
  }
  return out;
}

TimeNs time_of(const map::BundledMap& map, const RigProblem& problem, std::size_t pose) {
  return map.keyframe(problem.selected.keyframes[pose]).frame->time_ns;
}

std::vector<std::size_t> poses_by_time(const map::BundledMap& map, const RigProblem& problem) {
  std::vector<std::size_t> out(problem.selected.keyframes.size());
  std::iota(out.begin(), out.end(), 0);
  std::ranges::stable_sort(out, {}, [&](std::size_t pose) { return time_of(map, problem, pose); });
  return out;
}

void separate_groups(RigProblem& problem) {
  std::vector<solver::ReprojectionProblem::Observation>& observations = problem.selected.problem.observations;
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
      problem.selected.sources[kept] = problem.selected.sources[o];
      observations[kept++] = observations[o];
    }
  }
  observations.resize(kept);
  problem.selected.sources.resize(kept);
  fix_one_of_each_part(problem);
}

}  // namespace bslam::calibration
