#include "looping/loop_correction.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <queue>

#include "base/median.h"
#include "looping/essential_graph.h"
#include "map/keyframe_landmarks.h"
#include "map/scene_depth.h"
#include "solver/reprojection.h"

namespace bslam::looping {
namespace {

using Eigen::Vector3d;
using geometry::SE3;
using geometry::Sim3;

constexpr double kMaxRotation = geometry::radians(20);  // rad: larger rotations cannot be explained by drift

Vector3d centre(const SE3& T_rig_world) { return T_rig_world.inverse().translation(); }

// Rigid pose in world units of a vertex of the pose graph.
SE3 pose_of(const Sim3& S_rig_world) {
  return SE3(S_rig_world.rotation(), S_rig_world.translation() / S_rig_world.scale());
}

// Median reprojection error, in pixels, of the matched landmarks of the place at the keyframe's current pose.
double reprojection_error_px(const map::BundledMap& map, KeyframeId keyframe, const PlaceMatch& place_match) {
  const map::BundledKeyframe& entry = map.keyframe(keyframe);
  const camera::Rig rig = map.rig_of(keyframe);
  std::vector<double> errors;
  for (const auto& [feature, l] : place_match.matches) {
    const frame::KeypointRef r = entry.frame->bundled.keypoints(feature).front();
    const Eigen::Vector2d pixel = entry.frame->keypoints(r.camera).pixel[r.keypoint.index()].cast<double>();
    const auto error =
        solver::ReprojectionResidual::error_only(rig, r.camera, entry.T_rig_world, map.landmark(l).position, pixel);
    errors.push_back(error ? error->norm() : std::numeric_limits<double>::infinity());
  }
  return errors.empty() ? 0.0 : median(std::move(errors));
}

// Distance between the verified pose and the matched keyframe, divided by the median distance to the landmarks
// observed by both.
double relative_distance(const map::BundledMap& map, const PlaceMatch& place_match) {
  const Vector3d here = centre(place_match.T_rig_world);
  std::vector<double> distances;
  for (const auto& [feature, l] : place_match.matches) distances.push_back((map.landmark(l).position - here).norm());
  if (distances.empty()) return std::numeric_limits<double>::infinity();
  return (here - centre(map.keyframe(place_match.matched_keyframe).T_rig_world)).norm() / median(std::move(distances));
}

// Length of the shortest way between two keyframes of a submap along the edges of its essential graph. Drift
// accumulates along it: where the submap is already joined by common landmarks, the way is short.
double way_between(const map::BundledMap& map, KeyframeId from, KeyframeId to, int edge_weight) {
  struct Edge {
    std::size_t to;
    double length;
  };
  struct Reached {
    double length;
    std::size_t vertex;
    bool operator>(const Reached& other) const { return length > other.length; }
  };
  const EssentialGraph graph = essential_graph(map, map.root_of(to), edge_weight);
  std::vector<std::vector<Edge>> edges(graph.keyframes.size());
  for (const PoseGraphProblem::Edge& e : graph.problem.edges) {
    const double length = e.S_a_b.translation().norm();
    edges[static_cast<std::size_t>(e.a)].push_back({static_cast<std::size_t>(e.b), length});
    edges[static_cast<std::size_t>(e.b)].push_back({static_cast<std::size_t>(e.a), length});
  }
  std::vector<double> shortest(graph.keyframes.size(), std::numeric_limits<double>::infinity());
  std::priority_queue<Reached, std::vector<Reached>, std::greater<>> next;
  next.push({0.0, static_cast<std::size_t>(graph.vertex(from))});
  while (!next.empty()) {
    const Reached r = next.top();
    next.pop();
    if (r.length >= shortest[r.vertex]) continue;
    shortest[r.vertex] = r.length;
    if (graph.keyframes[r.vertex] == to) break;
    for (const Edge& e : edges[r.vertex]) next.push({r.length + e.length, e.to});
  }
  return shortest[static_cast<std::size_t>(graph.vertex(to))];
}

// The keyframe and its best covisible keyframes: they are moved together and fused with the place.
std::vector<KeyframeId> window_of(const map::BundledMap& map, KeyframeId keyframe, int size) {
  std::vector<KeyframeId> window = {keyframe};
  for (const map::Covisible& c : map.best_covisible(keyframe, static_cast<std::size_t>(size)))
    window.push_back(c.keyframe);
  std::sort(window.begin(), window.end());
  return window;
}

// Whether a keyframe was created closer in time to the matched keyframe than to the current one. Tracking may have
// joined both ends of the loop already, so that keyframes of the place are among the neighbours of the current one.
bool at_place(KeyframeId k, const LoopClosure& closure) {
  const auto distance = [&](KeyframeId other) { return std::abs(k.value() - other.value()); };
  return distance(closure.matched_keyframe) < distance(closure.keyframe);
}

// Fuses the window with the place. The keyframe's landmarks are merged with the landmarks it was matched to; then the
// landmarks of the place are projected into all keyframes of the window at the given poses.
void fuse(const std::vector<KeyframeId>& window, const std::vector<SE3>& T_rig_world, const LoopClosure& closure,
          const PlaceMatch& place_match, const LoopOptions& options, const feature::FeatureModel& features,
          map::MapDraft& draft) {
  const std::vector<LandmarkId> place = landmarks_around(draft.map(), closure.matched_keyframe, options.window,
                                                         static_cast<int>(draft.map().num_landmarks()));
  for (const auto& [feature, there] : place_match.matches) {
    const LandmarkId here = draft.map().landmark_of(closure.keyframe, feature);
    const LandmarkId now = draft.map().resolve(there);
    if (!now.valid() || here == now) continue;
    if (here.valid()) {
      draft.merge_landmarks(here, now);
    } else {
      draft.add_observation(now, {closure.keyframe, feature, false});
    }
  }
  for (std::size_t i = 0; i < window.size(); ++i) {
    mapping::fuse_into(window[i], T_rig_world[i], place, mapping::Keep::kSearched, options.fusion, features, draft);
    draft.refresh_landmarks(map::landmarks_of(draft.map(), window[i]));
  }
}

// Moves a keyframe from one vertex of the pose graph to another; lengths about it change with the vertex's scale.
void move_keyframe(KeyframeId k, const Sim3& before, const Sim3& after, map::SetPoses& poses) {
  poses.keyframes.emplace_back(k, pose_of(after));
  if (after.scale() != before.scale()) poses.scale_changes.emplace_back(k, before.scale() / after.scale());
}

// Moves the keyframes of the window, and the landmarks attached to them, to their poses relative to the place.
void move_window(const std::vector<KeyframeId>& window, const EssentialGraph& graph, const std::vector<Sim3>& before,
                 map::MapDraft& draft) {
  map::SetPoses poses;
  for (const KeyframeId k : window) {
    const auto v = static_cast<std::size_t>(graph.vertex(k));
    move_keyframe(k, before[v], graph.problem.S_world[v], poses);
    for (const LandmarkId l : map::landmarks_of(draft.map(), k)) {
      const map::Landmark& landmark = draft.map().landmark(l);
      if (landmark.reference.keyframe != k) continue;
      poses.landmarks.emplace_back(l, graph.problem.S_world[v].inverse() * (before[v] * landmark.position));
    }
  }
  draft.set_poses(std::move(poses));
}

// Adds an edge between each keyframe of the window and each keyframe with which the fusion gave it enough shared
// landmarks.
void add_loop_edges(const map::BundledMap& before, const map::BundledMap& fused, const std::vector<KeyframeId>& window,
                    const LoopClosure& closure, EssentialGraph& graph) {
  constexpr int kMinGained = 15;
  for (const KeyframeId k : window) {
    const auto& old = before.keyframe(k).covisible;
    for (const map::Covisible& c : fused.keyframe(k).covisible) {
      const int b = graph.vertex(c.keyframe);
      if (b < 0 || std::binary_search(window.begin(), window.end(), c.keyframe)) continue;
      const auto known = std::ranges::find(old, c.keyframe, &map::Covisible::keyframe);
      const int gained = c.weight - (known == old.end() ? 0 : known->weight);
      const bool the_loop = k == closure.keyframe && c.keyframe == closure.matched_keyframe;
      if (gained < kMinGained && !the_loop) continue;
      const int a = graph.vertex(k);
      const auto& S = graph.problem.S_world;
      graph.problem.edges.push_back(
          {a, b, S[static_cast<std::size_t>(a)] * S[static_cast<std::size_t>(b)].inverse(), 1.0});
    }
  }
}

// Returns the optimised poses of all keyframes of the graph. Every landmark moves with the keyframe of its reference.
map::SetPoses corrected(const map::BundledMap& map, const EssentialGraph& graph, const std::vector<Sim3>& before) {
  map::SetPoses poses;
  poses.correction = true;
  for (std::size_t v = 0; v < graph.keyframes.size(); ++v) {
    move_keyframe(graph.keyframes[v], before[v], graph.problem.S_world[v], poses);
  }
  for (const LandmarkId l : map.landmark_ids()) {
    const int v = graph.vertex(map.landmark(l).reference.keyframe);
    if (v < 0) continue;
    const auto i = static_cast<std::size_t>(v);
    poses.landmarks.emplace_back(l, graph.problem.S_world[i].inverse() * (before[i] * map.landmark(l).position));
  }
  return poses;
}

// The viewing directions of moved landmarks change and, if the scale changed, their distances, so they are refreshed.
void move_map(map::SetPoses poses, map::MapDraft& draft) {
  std::vector<LandmarkId> moved;
  moved.reserve(poses.landmarks.size());
  for (const auto& [l, position] : poses.landmarks) moved.push_back(l);
  draft.set_poses(std::move(poses));
  draft.refresh_landmarks(std::move(moved));
}

// Uncertainty of the keyframes of the submap of `from`, which `motion` (world of `to` from that of `from`) moves into
// the submap of `to`. A keyframe k has the error e_k - e_from + e_to, each transported to k. The noise in the three
// counts as independent; the global adjustment that follows replaces this upper bound.
void move_uncertainties(const map::BundledMap& map, KeyframeId from, KeyframeId to, const SE3& motion,
                        map::SetPoses& poses) {
  const SE3& T_from_world = map.keyframe(from).T_rig_world;
  const SE3 T_from_to = T_from_world * motion.inverse() * map.keyframe(to).T_rig_world.inverse();
  geometry::PoseUncertainty minus_from = map.keyframe(from).uncertainty;
  minus_from.calibration *= -1;
  const geometry::PoseUncertainty joint = minus_from + geometry::transported(map.keyframe(to).uncertainty, T_from_to);
  for (const auto& [k, T_new] : poses.keyframes) {
    const map::BundledKeyframe& keyframe = map.keyframe(k);
    const SE3 T_k_from = keyframe.T_rig_world * T_from_world.inverse();
    poses.uncertainties.emplace_back(k, keyframe.uncertainty + geometry::transported(joint, T_k_from));
  }
}

}  // namespace

LoopClosure measure(const map::BundledMap& map, KeyframeId keyframe, const PlaceMatch& place_match) {
  LoopClosure out{
      .keyframe = keyframe, .matched_keyframe = place_match.matched_keyframe, .inliers = place_match.inliers};
  const SE3& now = map.keyframe(keyframe).T_rig_world;
  out.translation_correction = (centre(now) - centre(place_match.T_rig_world)).norm();
  out.rotation_correction =
      (now.rotation() * place_match.T_rig_world.rotation().conjugate()).angularDistance(Eigen::Quaterniond::Identity());
  out.reprojection_error_px = reprojection_error_px(map, keyframe, place_match);
  out.scale_correction = place_match.scale;
  out.relative_distance = relative_distance(map, place_match);
  out.merged = map.root_of(keyframe) != map.root_of(place_match.matched_keyframe);
  return out;
}

bool plausible(const map::BundledMap& map, const LoopClosure& closure, const LoopOptions& options) {
  if (closure.merged) return true;
  if (closure.relative_distance > options.max_distance_over_depth || closure.rotation_correction > kMaxRotation)
    return false;
  const double share = map.scale() == map::Scale::kMetric ? options.max_drift : options.max_drift_free;
  const double depth = map::median_depth(map, closure.keyframe);
  if (closure.translation_correction <= share * depth) return true;
  const double way = way_between(map, closure.keyframe, closure.matched_keyframe, options.edge_weight);
  return closure.translation_correction <= share * (way + depth);
}

void merge_submaps(const LoopClosure& closure, const PlaceMatch& place_match, const LoopOptions& options,
                   const feature::FeatureModel& features, map::MapDraft& draft) {
  const map::BundledMap& map = draft.map();
  const KeyframeId here = map.root_of(closure.keyframe), there = map.root_of(closure.matched_keyframe);
  const bool here_moves = there < here;  // the older submap keeps its pose and its scale
  const KeyframeId moving = here_moves ? here : there;
  const double factor = here_moves ? place_match.scale : 1 / place_match.scale;
  if (map.scale() != map::Scale::kMetric) draft.scale_submap(moving, factor);
  const SE3 T_rig_there = here_moves ? place_match.T_rig_world : geometry::scaled(place_match.T_rig_world, factor);
  const SE3 T_there_here = T_rig_there.inverse() * map.keyframe(closure.keyframe).T_rig_world;
  const SE3 motion = here_moves ? T_there_here : T_there_here.inverse();

  map::SetPoses poses;
  poses.correction = true;
  const std::vector<KeyframeId> root = map.root_of_each();
  for (const KeyframeId k : map.keyframe_ids()) {
    if (root[k.index()] == moving) poses.keyframes.emplace_back(k, map.keyframe(k).T_rig_world * motion.inverse());
  }
  const KeyframeId from = here_moves ? closure.keyframe : closure.matched_keyframe;
  const KeyframeId to = here_moves ? closure.matched_keyframe : closure.keyframe;
  move_uncertainties(map, from, to, motion, poses);
  for (const LandmarkId l : map.landmark_ids()) {
    if (root[map.landmark(l).reference.keyframe.index()] == moving)
      poses.landmarks.emplace_back(l, motion * map.landmark(l).position);
  }
  const std::vector<KeyframeId> window = window_of(map, closure.keyframe, options.window);
  move_map(std::move(poses), draft);
  draft.merge_submaps(from, to);
  std::vector<SE3> T_window;
  for (const KeyframeId k : window) T_window.push_back(draft.map().keyframe(k).T_rig_world);
  fuse(window, T_window, closure, place_match, options, features, draft);
}

bool close_loop(const LoopClosure& closure, const PlaceMatch& place_match, const LoopOptions& options,
                const feature::FeatureModel& features, map::MapDraft& draft) {
  const map::BundledMap before = draft.map();
  EssentialGraph graph = essential_graph(before, before.root_of(closure.keyframe), options.edge_weight);
  std::vector<KeyframeId> window = window_of(before, closure.keyframe, options.window);
  std::erase_if(window, [&](KeyframeId k) { return graph.vertex(k) < 0 || at_place(k, closure); });

  // Poses of the window as given by the verification: S_i' = T_i T_k^-1 S_k', in the scale of the window.
  const std::vector<Sim3> S_before = graph.problem.S_world;
  const double scale = 1.0 / closure.scale_correction;
  const Sim3 S_keyframe(scale, place_match.T_rig_world.rotation(), scale * place_match.T_rig_world.translation());
  const Sim3 S_keyframe_before(before.keyframe(closure.keyframe).T_rig_world);
  for (const KeyframeId k : window) {
    const auto v = static_cast<std::size_t>(graph.vertex(k));
    graph.problem.S_world[v] = S_before[v] * S_keyframe_before.inverse() * S_keyframe;
  }
  std::vector<SE3> T_window;
  for (const KeyframeId k : window)
    T_window.push_back(pose_of(graph.problem.S_world[static_cast<std::size_t>(graph.vertex(k))]));
  if (closure.reprojection_error_px <= options.max_bundle_error_px && !graph.problem.free_scale) {
    // The error is small enough for bundle adjustment to remove it, starting from the present map. The pose verified
    // for a single keyframe is no more accurate than the map.
    fuse(window, T_window, closure, place_match, options, features, draft);
    return true;
  }
  move_window(window, graph, S_before, draft);
  fuse(window, T_window, closure, place_match, options, features, draft);
  add_loop_edges(before, draft.map(), window, closure, graph);

  const std::vector<Sim3> S_fused = graph.problem.S_world;
  if (!optimise(graph.problem, options.pose_graph).usable()) return false;
  move_map(corrected(draft.map(), graph, S_fused), draft);
  return true;
}

}  // namespace bslam::looping
