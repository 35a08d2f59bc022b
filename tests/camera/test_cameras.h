// Cameras of every model for tests: published calibrations and extreme lenses.
#pragma once

#include <string>
#include <vector>

#include "camera/camera.h"

namespace bslam::camera {

inline std::vector<Camera> test_cameras() {
  const auto camera = [](std::string name, CameraModel model, int width, int height) {
    return Camera{std::move(name), std::move(model), width, height, 0, ""};
  };
  return {
      camera("pinhole", Pinhole({707.0912, 700.5, 601.8873, 183.1104}), 1226, 370),
      camera("radtan4_euroc",
             PinholeRadTan({458.654, 457.296, 367.215, 248.375}, {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05}),
             752, 480),
      camera("radtan5_kitti",
             PinholeRadTan({984.2439, 980.8141, 690.0, 233.1966},
                           {-0.3728755, 0.2037299, 0.002219027, 0.001383707, -0.07233722}),
             1392, 512),
      camera("radtan8_rational",
             PinholeRadTan({610.2, 611.4, 640.3, 362.9}, {0.38, -2.6, 0.0004, -0.0003, 1.5, 0.26, -2.4, 1.43}), 1280,
             720),
      camera("radtan_pincushion", PinholeRadTan({400, 400, 320, 240}, {0.2, 0.05, 0.001, -0.002}), 640, 480),
      camera("fisheye_aria",
             KannalaBrandt({245.445231, 245.439242, 254.256944, 259.183324},
                           {0.015783166, 0.026943495, -0.04571934, 0.007215107}),
             512, 512),
      camera("fisheye_tumvi",
             KannalaBrandt({190.978, 190.973, 254.932, 256.897},
                           {0.0034823894, 0.0007150348, -0.0020532361, 0.00020293673}),
             512, 512),
      // The published double sphere calibration of EuRoC's cam0, and lenses on both sides of alpha = 1/2.
      camera("double_sphere_euroc", DoubleSphere({349.75, 348.64, 365.9, 249.3}, -0.2409, 0.5670), 752, 480),
      camera("double_sphere_wide", DoubleSphere({150, 151, 319.5, 239.5}, 0.15, 0.6), 640, 480),
      camera("double_sphere_below_half", DoubleSphere({300, 301, 319.5, 239.5}, 0.1, 0.3), 640, 480),
      camera("ucm", Unified({230, 231, 319.5, 239.5}, 0.62), 640, 480),
      camera("ucm_below_half", Unified({260, 259, 322, 238}, 0.4), 640, 480),
      camera("eucm", ExtendedUnified({235, 234, 318, 240}, 0.6, 1.1), 640, 480),
      camera("eucm_below_half", ExtendedUnified({235, 234, 318, 240}, 0.45, 0.9), 640, 480),
      // The published calibration of TUM monoVO's wide lens, its fractions of the image in pixels; a lens whose image
      // reaches beyond the model's domain in the corners; and hardly any distortion.
      camera("fov_monovo", Fov({685.720714, 685.636463, 630.858138, 511.918473}, 0.897966326944875), 1280, 1024),
      camera("fov_wide", Fov({280, 281, 319.5, 239.5}, 1.2), 640, 480),
      camera("fov_faint", Fov({500, 501, 322, 238}, 0.01), 640, 480),
      // A field of view of 220 degrees, which includes points behind the image plane.
      camera("fisheye_wide", KannalaBrandt({130.0, 131.0, 319.5, 239.5}, {-0.01, 0.002, -0.0003, 0.00001}), 640, 480),
  };
}

// Whether OpenCV has the model.
inline bool is_opencv_model(const CameraModel& model) {
  return std::holds_alternative<Pinhole>(model) || std::holds_alternative<PinholeRadTan>(model) ||
         std::holds_alternative<KannalaBrandt>(model);
}

}  // namespace bslam::camera
