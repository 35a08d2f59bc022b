#include "matching/projection_search.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "feature/hamming.h"

namespace bslam::matching {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kNone = 1 << 20;
constexpr double kMinRadius_px = 1;  // in coarse images, a smaller one would be less than the noise of keypoints

struct Candidate {
  int best = kNone, second = kNone;
  int best_level = -1, second_level = -1;
  std::uint32_t keypoint = 0;
};

// The range of sizes of a point is extended by 20 %, because levels overlap.
struct RangeExtension {
  double larger = 1.2, smaller = 0.8;

  // By less than one and a half levels, so that the levels searched include one of the image.
  static RangeExtension of_levels(double scale_factor) {
    const double most = std::pow(scale_factor, 1.49);
    return {std::min(1.2, most), std::max(0.8, 1.0 / most)};
  }
};

// `pixel_m`: width of a level-0 pixel at the point.
bool in_range(const SearchPoint& p, double pixel_m, const RangeExtension& extension) {
  return p.max_pixel <= 0 || (pixel_m > extension.smaller * p.min_pixel && pixel_m < extension.larger * p.max_pixel);
}

// Level on which the point is predicted.
double predicted_level(const SearchPoint& p, double pixel_m, double log_factor) {
  return p.max_pixel > 0 ? std::log(p.max_pixel / pixel_m) / log_factor : 0.0;
}

struct Projection {
  Vector2d pixel;
  double pixel_m;  // width of a level-0 pixel at the point
};

// An image into which points are projected.
class View {
 public:
  View(const camera::Rig& rig, CameraIndex c, const geometry::SE3& T_cam_common, double max_view_angle,
       const RangeExtension& range)
      : camera_(rig.camera(c)),
        shutter_(rig.shutter(c.index())),
        R_(T_cam_common.matrix3()),
        t_(T_cam_common.translation()),
        centre_(-R_.transpose() * t_),
        axis_(R_.row(2).transpose()),
        min_cosine_(std::cos(max_view_angle)),
        min_axis_cosine_(rig.min_axis_cosine(c)),
        radians_per_pixel_(camera_.radians_per_pixel()),
        range_(range) {}

  // Projection of a point. Returns nullopt if it is outside the image, its range of sizes, or its cone of viewing
  // directions.
  std::optional<Projection> project(const SearchPoint& p) const {
    const Vector3d ray = p.position - centre_;
    const double distance = ray.norm(), pixel_m = distance * radians_per_pixel_;
    if (!in_range(p, pixel_m, range_) || ray.dot(axis_) < min_axis_cosine_ * distance) return std::nullopt;
    const bool outside_cone = ray.dot(p.view_direction) < min_cosine_ * distance;
    if (outside_cone && p.view_direction != Vector3d::Zero()) return std::nullopt;
    const auto pixel = camera::project(camera_, shutter_, R_ * p.position + t_);
    if (!pixel || !camera_.contains(*pixel)) return std::nullopt;
    return Projection{*pixel, pixel_m};
  }

 private:
  const camera::Camera& camera_;
  const camera::Shutter& shutter_;
  Eigen::Matrix3d R_;
  Vector3d t_, centre_, axis_;  // metres; centre and optical axis in the common frame
  // Minimum cosines of the angle between viewing directions and of the angle to the optical axis.
  double min_cosine_, min_axis_cosine_;
  double radians_per_pixel_;
  RangeExtension range_;
};

Candidate best_candidate(const feature::Keypoints& keypoints, const feature::Descriptor& descriptor,
                         std::span<const std::uint32_t> near, std::span<const std::uint8_t> taken) {
  Candidate c;
  for (const std::uint32_t k : near) {
    if (!taken.empty() && taken[k]) continue;
    const int distance = feature::hamming(descriptor, keypoints.descriptor[k]);
    const int level = keypoints.level[k];
    if (distance < c.best) {
      c.second = c.best;
      c.second_level = c.best_level;
      c.best = distance;
      c.best_level = level;
      c.keypoint = k;
    } else if (distance < c.second) {
      c.second = distance;
      c.second_level = level;
    }
  }
  return c;
}

}  // namespace

ProjectionSearchResult search_by_projection(const camera::Rig& rig, CameraIndex c, const frame::CameraFrame& frame,
                                            const geometry::SE3& T_cam_common, std::span<const SearchPoint> points,
                                            const SearchExclusions& exclusions,
                                            const ProjectionSearchOptions& options) {
  const camera::Camera& camera = rig.camera(c);
  ProjectionSearchResult result;
  const feature::Keypoints& keypoints = frame.keypoints;
  const double log_factor = std::log(options.scale_factor);
  const double radius_px = std::max(options.radius / camera.radians_per_pixel(), kMinRadius_px);
  const View view(rig, c, T_cam_common, options.max_view_angle, RangeExtension::of_levels(options.scale_factor));
  std::vector<std::uint32_t> near;
  std::vector<std::pair<int, std::uint32_t>> owner(keypoints.size(), {kNone, 0});  // (hamming, position in matches)
  for (std::size_t i = 0; i < points.size(); ++i) {
    const SearchPoint& p = points[i];
    if (!exclusions.points.empty() && exclusions.points[i]) continue;
    const auto projected = view.project(p);
    if (!projected) continue;
    result.visible.push_back(static_cast<std::uint32_t>(i));
    const double level = predicted_level(p, projected->pixel_m, log_factor);
    const int centre = static_cast<int>(std::lround(level));
    near.clear();
    frame.grid.near(keypoints, projected->pixel, radius_px * std::pow(options.scale_factor, std::max(0.0, level)),
                    centre - options.level_slack, centre + options.level_slack, near);
    if (near.empty()) continue;
    const Candidate best = best_candidate(keypoints, *p.descriptor, near, exclusions.keypoints);
    if (best.best > options.max_hamming) continue;
    if (best.best_level == best.second_level && best.best > options.ratio * best.second) continue;
    auto& [owned, position] = owner[best.keypoint];
    if (best.best >= owned) continue;
    if (owned < kNone) result.matches[position].hamming = -1;  // this point is more similar
    owned = best.best;
    position = static_cast<std::uint32_t>(result.matches.size());
    result.matches.push_back(
        {static_cast<std::uint32_t>(i), KeypointIndex(static_cast<std::int32_t>(best.keypoint)), best.best});
  }
  std::erase_if(result.matches, [](const ProjectionMatch& m) { return m.hamming < 0; });
  return result;
}

std::vector<ProjectionSearchResult> search_cameras(const camera::Rig& rig, const frame::BundledFrame& frame,
                                                   std::span<const geometry::SE3> T_cam_common,
                                                   std::span<const SearchPoint> points,
                                                   std::span<const SearchExclusions> exclusions,
                                                   const ProjectionSearchOptions& options, ThreadPool* pool) {
  const SearchExclusions nothing;
  std::vector<ProjectionSearchResult> out(rig.size());
  const auto search = [&](std::size_t c) {
    if (frame.cameras[c].keypoints.empty()) return;
    out[c] = search_by_projection(rig, CameraIndex(c), frame.cameras[c], T_cam_common[c], points,
                                  exclusions.empty() ? nothing : exclusions[c], options);
  };
  if (pool != nullptr) {
    pool->for_each(rig.size(), search);
  } else {
    for (std::size_t c = 0; c < rig.size(); ++c) search(c);
  }
  return out;
}

std::vector<geometry::SE3> camera_poses(const camera::Rig& rig, const geometry::SE3& T_rig_common) {
  std::vector<geometry::SE3> out;
  for (std::size_t c = 0; c < rig.size(); ++c) out.push_back(rig.cam_from_rig(c) * T_rig_common);
  return out;
}

std::vector<VisiblePoint> visible_points(const camera::Rig& rig, CameraIndex c, const geometry::SE3& T_cam_common,
                                         std::span<const SearchPoint> points, double max_view_angle) {
  const View view(rig, c, T_cam_common, max_view_angle, {});
  std::vector<VisiblePoint> out;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto projected = view.project(points[i]);
    if (projected)
      out.push_back({static_cast<std::uint32_t>(i), projected->pixel, points[i].max_pixel / projected->pixel_m});
  }
  return out;
}

}  // namespace bslam::matching
