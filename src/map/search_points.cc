#include "map/search_points.h"

namespace bslam::map {

std::vector<matching::SearchPoint> search_points(const BundledMap& map, std::span<const LandmarkId> landmarks) {
  std::vector<matching::SearchPoint> points(landmarks.size());
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    const Landmark& l = map.landmark(landmarks[i]);
    points[i] = {l.position, l.view_direction, l.min_distance, l.max_distance, &l.descriptor};
  }
  return points;
}

}  // namespace bslam::map
