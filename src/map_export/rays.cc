#include "map_export/rays.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "map_export/landmark_information.h"

namespace bslam::map_export {

std::vector<Scan> scans_of(const Selection& selection) {
  const map::BundledMap& map = *selection.map;
  const geometry::SE3& T = selection.T_upright_world;
  std::map<std::pair<KeyframeId, CameraIndex>, Scan> scans;
  for (const LandmarkId l : selection.landmarks) {
    int keypoints = 0;
    for_each_keypoint(selection, l, [&](KeyframeId, frame::KeypointRef) { ++keypoints; });
    const Eigen::Matrix3d covariance = landmark_covariance(selection, l);
    const Eigen::Vector3d& position = map.landmark(l).position;
    if (keypoints < 2 || !covariance.allFinite() || !position.allFinite()) continue;
    for_each_keypoint(selection, l, [&](KeyframeId k, frame::KeypointRef r) {
      const Eigen::Vector3d centre = map.cam_from_world(k, r.camera).inverse().translation();
      const Eigen::Vector3d direction = (position - centre).normalized();
      Scan& scan = scans[{k, r.camera}];
      scan.origin = T * centre;
      scan.height = (T * selection.world_from_rig(k).translation()).z();
      scan.rays.push_back({T * position, std::sqrt(std::max(0.0, direction.dot(covariance * direction)))});
    });
  }
  std::vector<Scan> list;
  for (auto& [image, scan] : scans) list.push_back(std::move(scan));
  return list;
}

CarvedRay carve(const Eigen::Vector3d& origin, const Ray& ray, const CarvingOptions& options) {
  constexpr double kSigmas = 2.0;
  const double length = (ray.end - origin).norm();
  const bool certain = ray.sigma <= options.resolution;
  const double before = certain ? 0.0 : kSigmas * ray.sigma;
  const double free = std::clamp(length - before, 0.0, options.max_range);
  const double share = length > 0 ? free / length : 0.0;
  return {origin + share * (ray.end - origin), certain && length <= options.max_range};
}

double default_resolution(double median_depth) {
  constexpr double kCellsPerDepth = 40;
  const double wanted = median_depth > 0 ? median_depth / kCellsPerDepth : 0.1;
  const double decade = std::pow(10.0, std::floor(std::log10(wanted)));
  for (const double factor : {5.0, 2.0}) {
    if (wanted >= factor * decade) return factor * decade;
  }
  return decade;
}

}  // namespace bslam::map_export
