// A closed polyline in the plane, parametrised by arc length.
#pragma once

#include <vector>

#include "simulator/surface.h"

namespace bslam::simulator {

class ClosedPath {
 public:
  explicit ClosedPath(std::vector<Vector2d> points);

  double length() const { return at_.back(); }  // metres

  // The position at an arc length, which may have any value: the path continues after its end.
  Vector2d operator()(double arc) const;

  // The direction at an arc length: the unit vector between the positions `reach` metres before and after it.
  Vector2d tangent(double arc, double reach) const {
    return ((*this)(arc + reach) - (*this)(arc - reach)).normalized();
  }

 private:
  std::vector<Vector2d> points_;
  std::vector<double> at_;  // arc length at each point, and total length
};

}  // namespace bslam::simulator
