#include "session/report_map.h"

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include "geometry/vertical_direction.h"
#include "session/report_loops.h"

namespace bslam::session {
namespace {

using geometry::SE3;
using geometry::Vector3d;
using nlohmann::ordered_json;

void append(const Vector3d& v, std::vector<float>& values) {
  for (int i = 0; i < 3; ++i) values.push_back(static_cast<float>(v[i]));
}

void append(const Eigen::Quaterniond& q, std::vector<float>& values) {
  for (const double c : {q.x(), q.y(), q.z(), q.w()}) values.push_back(static_cast<float>(c));
}

ordered_json number_list(const Vector3d& v) { return {v.x(), v.y(), v.z()}; }

// Collects the arrays of one submap.
struct Submap {
  KeyframeId root;
  std::vector<SE3> T_world_rig;  // poses of the keyframes
  std::vector<float> keyframe_time, keyframe_position, keyframe_rotation, point_position, point_time;
};

float seconds_since(TimeNs time_ns, TimeNs first_ns) { return static_cast<float>(to_seconds(time_ns - first_ns)); }

// All submaps with keyframes: those of the trajectories first.
std::vector<Submap> submaps_of(const map::BundledMap& map, std::span<const system::SubmapTrajectory> paths) {
  std::vector<KeyframeId> roots;
  for (const system::SubmapTrajectory& path : paths) roots.push_back(path.root);
  for (const KeyframeId root : map.roots()) {
    if (std::ranges::find(roots, root) == roots.end()) roots.push_back(root);
  }
  std::vector<Submap> submaps;
  for (const KeyframeId root : roots) submaps.emplace_back().root = root;
  return submaps;
}

// Adds the keyframes, and returns the number of the submap of each keyframe slot.
std::vector<std::size_t> add_keyframes(const map::BundledMap& map, TimeNs first_ns, std::vector<Submap>& submaps) {
  std::vector<std::size_t> submap_of(map.keyframe_slots(), 0);
  for (std::size_t s = 0; s < submaps.size(); ++s) {
    if (!map.alive(submaps[s].root)) continue;
    std::vector<KeyframeId> keyframes = map.keyframes_of_submap(submaps[s].root);
    std::ranges::sort(keyframes, {}, [&map](KeyframeId k) { return std::pair(map.keyframe(k).frame->time_ns, k); });
    for (const KeyframeId k : keyframes) {
      submap_of[k.index()] = s;
      const SE3 T_world_rig = map.keyframe(k).T_rig_world.inverse();
      submaps[s].T_world_rig.push_back(T_world_rig);
      submaps[s].keyframe_time.push_back(seconds_since(map.keyframe(k).frame->time_ns, first_ns));
      append(T_world_rig.translation(), submaps[s].keyframe_position);
      append(T_world_rig.rotation(), submaps[s].keyframe_rotation);
    }
  }
  return submap_of;
}

// The time of a landmark is that of its reference keyframe.
void add_points(const map::BundledMap& map, TimeNs first_ns, const std::vector<std::size_t>& submap_of,
                std::size_t limit, std::vector<Submap>& submaps) {
  const std::vector<LandmarkId> landmarks = map.landmark_ids();
  const std::size_t stride = report_stride(landmarks.size(), limit);
  for (std::size_t i = 0; i < landmarks.size(); i += stride) {
    const map::Landmark& landmark = map.landmark(landmarks[i]);
    const KeyframeId k = landmark.reference.keyframe;
    Submap& submap = submaps[submap_of[k.index()]];
    append(landmark.position, submap.point_position);
    submap.point_time.push_back(seconds_since(map.keyframe(k).frame->time_ns, first_ns));
  }
}

// Per submap: the pairs of keyframes at the ends of its loop closures.
std::vector<ordered_json> loops_json(std::span<const PlaceEvent> loops, const std::vector<Submap>& submaps) {
  std::vector<std::vector<float>> times;
  for (const Submap& submap : submaps) times.push_back(submap.keyframe_time);
  std::vector<ordered_json> lists(submaps.size(), ordered_json::array());
  for (const ReportLoop& loop : report_loops(loops, times))
    lists[loop.submap].push_back(ordered_json::array({loop.at, loop.with}));
  return lists;
}

ordered_json path_json(const evaluation::Trajectory& path, TimeNs first_ns, std::size_t limit) {
  std::vector<float> time, position, rotation;
  const std::size_t stride = report_stride(path.size(), limit);
  for (std::size_t i = 0; i < path.size(); i += stride) {
    time.push_back(seconds_since(path[i].time_ns, first_ns));
    append(path[i].T_world_frame.translation(), position);
    append(path[i].T_world_frame.rotation(), rotation);
  }
  return {{"time", float_array(time)}, {"position", float_array(position)}, {"rotation", float_array(rotation)}};
}

// Returns the ray of a pixel at depth 1. If the ray is too far from the optical axis to be drawn, returns the ray of a
// pixel nearer to the centre.
Vector3d ray_at_corner(const camera::Camera& camera, const Eigen::Vector2d& corner) {
  constexpr double kMinDepth = 0.35;  // minimum z of a ray of length 1
  const Eigen::Vector2d centre(0.5 * (camera.width - 1), 0.5 * (camera.height - 1));
  for (double share = 1.0; share > 0.2; share -= 0.05) {
    const auto ray = camera.unproject(centre + share * (corner - centre));
    if (ray && ray->z() > kMinDepth * ray->norm()) return *ray / ray->z();
  }
  return {0, 0, 1};
}

Vector3d upward(std::span<const SE3> T_world_rig, const std::optional<geometry::UpAxis>& up, const SE3& T_body_rig) {
  if (up) {
    const auto found = geometry::up_in_world(*up, T_world_rig, T_body_rig);
    if (found) return *found;
  }
  return geometry::vertical_direction(T_world_rig);
}

}  // namespace

ordered_json report_submaps(const map::BundledMap& map, const SubmapsRequest& request) {
  const auto& [paths, loops, first_time_ns, limits, up] = request;
  std::vector<Submap> submaps = submaps_of(map, paths);
  const std::vector<std::size_t> submap_of = add_keyframes(map, first_time_ns, submaps);
  if (!submaps.empty()) add_points(map, first_time_ns, submap_of, limits.points, submaps);
  const std::vector<ordered_json> loops_of = loops_json(loops, submaps);
  ordered_json list = ordered_json::array();
  for (std::size_t s = 0; s < submaps.size(); ++s) {
    const Submap& submap = submaps[s];
    const evaluation::Trajectory path = s < paths.size() ? paths[s].poses : evaluation::Trajectory();
    list.push_back(
        {{"root", submap.root.index()},
         {"loaded", s < paths.size() && paths[s].loaded},
         {"frames", path.size()},
         {"up", number_list(upward(submap.T_world_rig, up, map.rig().body_from_rig()))},
         {"path", path_json(path, first_time_ns, limits.poses)},
         {"keyframes",
          {{"time", float_array(submap.keyframe_time)},
           {"position", float_array(submap.keyframe_position)},
           {"rotation", float_array(submap.keyframe_rotation)}}},
         {"loops", loops_of[s]},
         {"points", {{"position", float_array(submap.point_position)}, {"time", float_array(submap.point_time)}}}});
  }
  return list;
}

ordered_json report_rig(const camera::Rig& rig) {
  ordered_json list = ordered_json::array();
  for (std::size_t c = 0; c < rig.size(); ++c) {
    const camera::Camera& camera = rig.camera(c);
    const double right = camera.width - 1, bottom = camera.height - 1;
    ordered_json corners = ordered_json::array();
    for (const Eigen::Vector2d& corner :
         std::array<Eigen::Vector2d, 4>{Eigen::Vector2d{0, 0}, Eigen::Vector2d{right, 0},
                                        Eigen::Vector2d{right, bottom}, Eigen::Vector2d{0, bottom}})
      corners.push_back(number_list(ray_at_corner(camera, corner)));
    const SE3& T_rig_cam = rig.rig_from_cam(c);
    const Eigen::Quaterniond& q = T_rig_cam.rotation();
    list.push_back({{"name", camera.name},
                    {"model", std::visit([](const auto& model) { return model.kName; }, camera.model)},
                    {"width", camera.width},
                    {"height", camera.height},
                    {"position", number_list(T_rig_cam.translation())},
                    {"rotation", {q.x(), q.y(), q.z(), q.w()}},
                    {"corners", corners}});
  }
  return list;
}

}  // namespace bslam::session
