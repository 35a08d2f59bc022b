// A stereo rig for tests of calibrations.
#pragma once

#include "camera/rig.h"
#include "geometry/so3.h"

namespace bslam::camera {

// A stereo pair whose body frame is rotated and translated relative to camera 0.
inline Rig stereo_rig() {
  const auto pinhole = [](double f) { return Camera{"p", Pinhole({f, f, 319.5, 239.5}), 640, 480, 0, ""}; };
  const geometry::SE3 T_body_cam0(geometry::so3_exp({0.4, -1.0, 0.7}), {0.2, -0.1, 0.3});
  const geometry::SE3 step(geometry::so3_exp({0.02, -0.05, 0.01}), {0.12, 0.01, -0.01});
  return Rig({{pinhole(300), T_body_cam0}, {pinhole(330), T_body_cam0 * step}});
}

}  // namespace bslam::camera
