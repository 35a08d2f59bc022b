#include "mapping/create_landmarks.h"

#include <algorithm>
#include <cmath>

#include "map/scene_depth.h"
#include "matching/epipolar_search.h"
#include "matching/point_estimation.h"

namespace bslam::mapping {
namespace {

using Eigen::Vector3d;
using frame::KeypointRef;
using geometry::SE3;

// Maximum ratio of the size change predicted from the distances and resolutions of two views to the size change between
// their pyramid levels.
constexpr double kMaxScaleRatio = 2.0;
// Whether two cameras have a common view is tested with every kProbeStep-th keypoint.
constexpr std::size_t kProbeStep = 16;
constexpr double kMinShared = 0.1;

// Returns one flag per keypoint of a camera: 1 if its feature has no landmark.
std::vector<std::uint8_t> free_keypoints(const map::BundledKeyframe& keyframe, CameraIndex c) {
  const std::size_t n = keyframe.frame->keypoints(c).size();
  std::vector<std::uint8_t> free(n);
  for (std::size_t k = 0; k < n; ++k) {
    free[k] = !keyframe.landmarks[keyframe.frame->bundled.feature(c, KeypointIndex(k)).index()].valid();
  }
  return free;
}

struct View {
  KeyframeId keyframe;
  CameraIndex camera;
};

SE3 cam_from_world(const map::BundledMap& map, View v) { return map.cam_from_world(v.keyframe, v.camera); }

double baseline(const map::BundledMap& map, View a, View b) {
  const auto centre = [&](View v) { return cam_from_world(map, v).inverse().translation().eval(); };
  return (centre(a) - centre(b)).norm();
}

// The longest way of a camera between two keyframes. If the rig turns about one camera, the others move.
double longest_way(const map::BundledMap& map, KeyframeId a, KeyframeId b) {
  double longest = 0;
  for (std::size_t c = 0; c < map.rig().size(); ++c)
    longest = std::max(longest, baseline(map, {a, CameraIndex(c)}, {b, CameraIndex(c)}));
  return longest;
}

// Returns true if camera b observes enough of the points that camera a observes at a depth of about `depth` metres.
bool shares_view(const map::BundledMap& map, View a, View b, double depth) {
  const feature::Keypoints& keypoints = map.keypoints(a.keyframe, a.camera);
  const camera::Camera& camera_b = map.rig().camera(b.camera);
  const SE3 T_b_a = cam_from_world(map, b) * cam_from_world(map, a).inverse();
  std::size_t probes = 0, seen = 0;
  for (std::size_t k = 0; k < keypoints.size(); k += kProbeStep, ++probes) {
    const auto pixel = camera_b.project(T_b_a * (depth * keypoints.bearing[k]));
    seen += pixel && camera_b.contains(*pixel);
  }
  return static_cast<double>(seen) > kMinShared * static_cast<double>(probes);
}

void append(const map::BundledMap& map, KeyframeId k, FeatureId f, std::vector<matching::PointObservation>& out,
            const feature::FeatureModel& features) {
  const map::BundledKeyframe& keyframe = map.keyframe(k);
  for (const KeypointRef r : keyframe.frame->bundled.keypoints(f)) {
    const feature::Keypoints& keypoints = keyframe.frame->keypoints(r.camera);
    const std::size_t i = r.keypoint.index();
    out.push_back({&map.rig().camera(r.camera), map.cam_from_world(k, r), keypoints.pixel[i].cast<double>(),
                   keypoints.bearing[i], features.sigma(keypoints.level[i])});
  }
}

// Tests whether the ratio of the widths of a pixel at the point agrees with the ratio of the pyramid levels.
bool sizes_agree(const Vector3d& point, View a, KeypointIndex ka, View b, KeypointIndex kb, const map::BundledMap& map,
                 const feature::PyramidShape& pyramid) {
  const auto pixel_m = [&](View v) {
    return (cam_from_world(map, v) * point).norm() * map.rig().camera(v.camera).radians_per_pixel();
  };
  const int levels =
      map.keypoints(a.keyframe, a.camera).level[ka.index()] - map.keypoints(b.keyframe, b.camera).level[kb.index()];
  const double ratio = pixel_m(a) / pixel_m(b) * pyramid.scale(levels);
  return ratio < kMaxScaleRatio && ratio > 1.0 / kMaxScaleRatio;
}

// Triangulates two matched features. Returns nullopt if the point is not accurate or not consistent enough.
std::optional<Vector3d> new_point(const map::BundledMap& map, View a, const matching::EpipolarMatch& match, View b,
                                  const CreationOptions& options, const FeatureModel& features) {
  const FeatureId fa = map.keyframe(a.keyframe).frame->bundled.feature(a.camera, match.a);
  const FeatureId fb = map.keyframe(b.keyframe).frame->bundled.feature(b.camera, match.b);
  std::vector<matching::PointObservation> observations;
  append(map, a.keyframe, fa, observations, features);
  append(map, b.keyframe, fb, observations, features);
  const auto estimated = matching::estimate_point(observations, options.min_parallax);
  if (!estimated || estimated->worst_chi2 > options.max_chi2) return std::nullopt;
  const Vector3d from_a = estimated->point - cam_from_world(map, a).inverse().translation();
  const Vector3d ray = from_a.normalized();
  if (std::sqrt(ray.dot(estimated->covariance * ray)) > options.max_depth_error * from_a.norm()) return std::nullopt;
  if (!sizes_agree(estimated->point, a, match.a, b, match.b, map, features.pyramid)) return std::nullopt;
  return estimated->point;
}

void create_between(View a, View b, double depth, const CreationOptions& options, const FeatureModel& features,
                    map::MapDraft& draft) {
  const map::BundledMap& map = draft.map();
  if (baseline(map, a, b) < options.min_baseline_over_depth * depth || !shares_view(map, a, b, depth)) return;
  const std::vector<std::uint8_t> free_a = free_keypoints(map.keyframe(a.keyframe), a.camera);
  const std::vector<std::uint8_t> free_b = free_keypoints(map.keyframe(b.keyframe), b.camera);
  const auto view = [&](View v, std::span<const std::uint8_t> free) {
    return matching::EpipolarView{.camera = &map.rig().camera(v.camera),
                                  .keypoints = &map.keypoints(v.keyframe, v.camera),
                                  .T_common_cam = cam_from_world(map, v).inverse(),
                                  .usable = free,
                                  .features = &features,
                                  .shutter = map.shutter(v.keyframe, v.camera)};
  };
  const matching::EpipolarView view_a = view(a, free_a), view_b = view(b, free_b);
  const matching::EpipolarOptions search{.min_depth_m = 0.05 * depth,
                                         .sigmas = 2.0,
                                         .max_hamming = options.max_hamming,
                                         .ratio = options.ratio,
                                         .max_level_difference = 3,
                                         .scale_factor = features.pyramid.scale_factor};
  for (const matching::EpipolarMatch& m : matching::match_epipolar(view_a, view_b, search)) {
    const FeatureId fa = draft.map().keyframe(a.keyframe).frame->bundled.feature(a.camera, m.a);
    const FeatureId fb = draft.map().keyframe(b.keyframe).frame->bundled.feature(b.camera, m.b);
    if (draft.map().landmark_of(a.keyframe, fa).valid() || draft.map().landmark_of(b.keyframe, fb).valid()) continue;
    const auto point = new_point(draft.map(), a, m, b, options, features);
    if (!point) continue;
    // The newer view is the reference, since future views will resemble it more.
    std::vector<map::Observation> observations = {{b.keyframe, fb, false}, {a.keyframe, fa, true}};
    std::sort(observations.begin(), observations.end());
    draft.add_landmark(*point, std::move(observations), {a.keyframe, {a.camera, m.a}});
  }
}

}  // namespace

void create_landmarks(KeyframeId keyframe, const CreationOptions& options, const FeatureModel& features,
                      map::MapDraft& draft) {
  const double depth = map::median_depth(draft.map(), keyframe);
  if (depth <= 0) return;
  for (const map::Covisible& neighbour :
       draft.map().best_covisible(keyframe, static_cast<std::size_t>(options.neighbours))) {
    if (longest_way(draft.map(), keyframe, neighbour.keyframe) < options.min_baseline_over_depth * depth) continue;
    for (std::size_t i = 0; i < draft.map().rig().size(); ++i) {
      for (std::size_t j = 0; j < draft.map().rig().size(); ++j) {
        create_between({keyframe, CameraIndex(i)}, {neighbour.keyframe, CameraIndex(j)}, depth, options, features,
                       draft);
      }
    }
  }
}

}  // namespace bslam::mapping
