#include "map/search_points.h"

namespace bslam::map {

std::vector<matching::SearchPoint> search_points(const BundledMap& map, std::span<const LandmarkId> landmarks) {
  std::vector<float> radians_per_pixel;
  for (std::size_t c = 0; c < map.rig().size(); ++c)
    radians_per_pixel.push_back(static_cast<float>(map.rig().camera(c).radians_per_pixel()));
  std::vector<matching::SearchPoint> points(landmarks.size());
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    const Landmark& l = map.landmark(landmarks[i]);
    const float resolution = radians_per_pixel[l.reference.keypoint.camera.index()];
    points[i] = {l.position, l.view_direction, resolution * l.min_distance, resolution * l.max_distance, &l.descriptor};
  }
  return points;
}

}  // namespace bslam::map
