#include "simulator/closed_path.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace bslam::simulator {

ClosedPath::ClosedPath(std::vector<Vector2d> points) : points_(std::move(points)) {
  at_.push_back(0);
  for (std::size_t i = 0; i < points_.size(); ++i) {
    at_.push_back(at_.back() + (points_[(i + 1) % points_.size()] - points_[i]).norm());
  }
}

Vector2d ClosedPath::operator()(double arc) const {
  arc -= length() * std::floor(arc / length());
  const auto next = std::upper_bound(at_.begin() + 1, at_.end() - 1, arc);
  const std::size_t i = static_cast<std::size_t>(next - at_.begin()) - 1;
  const double fraction = (arc - at_[i]) / (at_[i + 1] - at_[i]);
  return points_[i] + fraction * (points_[(i + 1) % points_.size()] - points_[i]);
}

}  // namespace bslam::simulator
