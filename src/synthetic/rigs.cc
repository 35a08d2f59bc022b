#include "synthetic/rigs.h"

#include <cmath>
#include <numbers>
#include <string>

#include "base/assert.h"
#include "base/random.h"

namespace bslam::synthetic {
namespace {

using camera::Camera;
using camera::RigCamera;
using Eigen::Vector3d;
using geometry::SE3;
using std::numbers::pi;

// Returns T_body_cam of a level camera at `position` that looks along `yaw`, with small random mounting errors.
SE3 mounted(const Vector3d& position, double yaw, Random& random) {
  Eigen::Matrix3d R_body_cam;  // columns: x (right), y (down), z (forward) axis of a camera that looks along body x
  R_body_cam << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  const auto small = [&](double size) -> Vector3d {
    const Vector3d unit{random.normal(), random.normal(), random.normal()};
    return size * unit;
  };
  const Vector3d rotation_error = small(0.008), position_error = small(0.002);  // radians, metres
  const Eigen::Quaterniond turned =
      Eigen::AngleAxisd(yaw, Vector3d::UnitZ()) * geometry::so3_exp(rotation_error) * Eigen::Quaterniond(R_body_cam);
  return {turned, position + position_error};
}

// A camera like those of EuRoC, scaled to `width`, with slightly varied parameters.
Camera radtan_camera(const std::string& name, int width, Random& random) {
  const int height = static_cast<int>(std::lround(width * 480.0 / 752.0));
  const double scale = width / 752.0;
  const camera::Intrinsics k{scale * (458.0 + random.uniform(-2, 2)), scale * (457.2 + random.uniform(-2, 2)),
                             scale * (367.2 + random.uniform(-4, 12)), scale * (247.0 + random.uniform(-6, 6))};
  const std::vector<double> distortion = {-0.283 + random.uniform(-2e-3, 2e-3), 0.074 + random.uniform(-1e-3, 1e-3),
                                          2e-4 + random.uniform(-1e-4, 1e-4), 2e-5 + random.uniform(-1e-5, 1e-5)};
  return {name, camera::PinholeRadTan(k, distortion), width, height, 0, ""};
}

Camera fisheye_camera(const std::string& name, int width, Random& random) {
  // The image radius at 95 degrees is half the image width; the coefficients are typical of wide-angle lenses.
  const std::array<double, 4> distortion = {-0.02 + random.uniform(-2e-3, 2e-3), 0.004 + random.uniform(-5e-4, 5e-4),
                                            -8e-4, 5e-5};
  const double theta = 95.0 * pi / 180.0, t2 = theta * theta;
  const double r =
      theta * (1 + t2 * (distortion[0] + t2 * (distortion[1] + t2 * (distortion[2] + t2 * distortion[3]))));
  const double f = 0.5 * width / r, centre = 0.5 * (width - 1);
  const camera::Intrinsics k{f + random.uniform(-0.5, 0.5), f + random.uniform(-0.5, 0.5),
                             centre + random.uniform(-2, 2), centre + random.uniform(-2, 2)};
  return {name, camera::KannalaBrandt(k, distortion), width, width, 0, ""};
}

Vector3d around(double yaw, double radius) { return {radius * std::cos(yaw), radius * std::sin(yaw), 0.0}; }

}  // namespace

camera::Rig default_rig() {
  Random random(20, "default rig");
  std::vector<RigCamera> cameras;
  const auto add = [&](const char* name, const Vector3d& position, double yaw) {
    Camera camera = radtan_camera(name, 752, random);
    cameras.push_back({std::move(camera), mounted(position, yaw, random)});
  };
  add("front_left", {0.07, 0.055, 0.01}, 0.0);
  add("front_right", {0.07, -0.055, 0.01}, 0.0);
  add("left", {0.0, 0.09, 0.0}, 0.5 * pi);
  add("right", {0.0, -0.09, 0.0}, -0.5 * pi);
  return camera::Rig(std::move(cameras));
}

camera::Rig ring_rig(int n, int width) {
  BSLAM_ASSERT(n >= 1 && n <= 8, "the number of cameras must be 1 to 8");
  Random random(static_cast<std::uint64_t>(n), "ring rig");
  std::vector<RigCamera> cameras;
  for (int i = 0; i < n; ++i) {
    // Cameras 0 and 1 both look forward; the others are at multiples of 1/(n - 1) of the circle.
    const double yaw = i < 2 ? 0.0 : 2 * pi * (i - 1) / (n - 1);
    Vector3d position = around(yaw, 0.09);
    if (i < 2 && n >= 2) position += Vector3d(0, i == 0 ? 0.055 : -0.055, 0);
    Camera camera = radtan_camera("cam" + std::to_string(i), width, random);
    cameras.push_back({std::move(camera), mounted(position, yaw, random)});
  }
  return camera::Rig(std::move(cameras));
}

camera::Rig fisheye_rig(int n, int width) {
  BSLAM_ASSERT(n >= 1 && n <= 8, "the number of cameras must be 1 to 8");
  Random random(static_cast<std::uint64_t>(n), "fisheye rig");
  std::vector<RigCamera> cameras;
  for (int i = 0; i < n; ++i) {
    const double yaw = 2 * pi * i / n;
    Camera camera = fisheye_camera("cam" + std::to_string(i), width, random);
    cameras.push_back({std::move(camera), mounted(around(yaw, 0.08), yaw, random)});
  }
  return camera::Rig(std::move(cameras));
}

camera::Rig mixed_rig() {
  Random random(4, "mixed rig");
  std::vector<RigCamera> cameras;
  for (int i = 0; i < 4; ++i) {
    const double yaw = i < 2 ? 0.0 : i == 2 ? 0.5 * pi : -0.5 * pi;
    const Vector3d position = around(yaw, 0.08) + (i < 2 ? Vector3d(0, i == 0 ? 0.055 : -0.055, 0) : Vector3d::Zero());
    const std::string name = "cam" + std::to_string(i);
    Camera camera = i < 2 ? radtan_camera(name, 752, random) : fisheye_camera(name, 640, random);
    cameras.push_back({std::move(camera), mounted(position, yaw, random)});
  }
  return camera::Rig(std::move(cameras));
}

}  // namespace bslam::synthetic
