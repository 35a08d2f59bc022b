#include "geometry/sim3.h"

namespace bslam::geometry {

Sim3 Sim3::inverse() const {
  const Quaterniond r = rotation_.conjugate();
  return Sim3(1.0 / scale_, r, -(r * translation_) / scale_);
}

Sim3 Sim3::operator*(const Sim3& other) const {
  return Sim3(scale_ * other.scale_, rotation_ * other.rotation_, *this * other.translation_);
}

}  // namespace bslam::geometry
