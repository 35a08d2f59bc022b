#include "calibration/rig_warnings.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "calibration/rig_description.h"
#include "geometry/triangulation.h"

namespace bslam::calibration {
namespace {

using geometry::degrees;
using geometry::Vector2d;
using geometry::Vector3d;

constexpr double kMinBaseline = 1e-3, kMaxBaseline = 5.0;  // metres

Vector3d axis_of(const camera::Rig& rig, std::size_t i) { return rig.rig_from_cam(i).rotation() * Vector3d::UnitZ(); }

// Text that asks for the unit that would explain the length of the baselines.
std::string unit_question(const camera::Rig& rig) {
  double longest = 0.0;
  for (std::size_t i = 1; i < rig.size(); ++i) longest = std::max(longest, rig.rig_from_cam(i).translation().norm());
  return longest >= 10.0 && longest <= 5000.0 ? "are they millimetres? (metres are expected)" : "is the unit metres?";
}

geometry::SE3 between(const camera::Rig& rig, std::size_t i, std::size_t j) {
  return rig.cam_from_rig(i) * rig.rig_from_cam(j);
}

// One warning for all pairs, since a wrong unit affects all of them.
void warn_of_long_baselines(const camera::Rig& rig, std::vector<std::string>& warnings) {
  std::string first;
  int others = -1;
  for (std::size_t i = 0; i < rig.size(); ++i) {
    for (std::size_t j = i + 1; j < rig.size(); ++j) {
      const double length = between(rig, i, j).translation().norm();
      if (length <= kMaxBaseline) continue;
      if (others++ < 0) first = fmt::format("cameras {} and {} are {} apart", i, j, length_in_words(length));
    }
  }
  if (others < 0) return;
  const std::string rest = others == 0   ? ""
                           : others == 1 ? ", and another pair is too far apart as well"
                                         : fmt::format(", and {} other pairs are too far apart as well", others);
  warnings.push_back(fmt::format("{}{}: {}", first, rest, unit_question(rig)));
}

void warn_of_short_baseline(const camera::Rig& rig, std::size_t i, std::size_t j, std::vector<std::string>& warnings) {
  const geometry::SE3 T_i_j = between(rig, i, j);
  const double length = T_i_j.translation().norm();
  if (length >= kMinBaseline) return;
  const bool one_pose = length < 1e-9 && geometry::so3_log(T_i_j.rotation()).norm() < 1e-9;
  if (one_pose) {
    warnings.push_back(fmt::format("cameras {} and {} have the same extrinsics: is a transform missing?", i, j));
  } else {
    warnings.push_back(fmt::format("cameras {} and {} are {} apart: is a transform missing, or not in metres?", i, j,
                                   length_in_words(length)));
  }
}

void warn_of_principal_point(const camera::Camera& camera, std::size_t i, std::vector<std::string>& warnings) {
  constexpr double kFarOff = 0.2;  // distance from the centre, relative to the side of the image
  const camera::Intrinsics& k = camera::intrinsics(camera.model);
  const std::string point = fmt::format("camera {}: principal point ({:.1f}, {:.1f})", i, k.cx, k.cy);
  const std::string image = fmt::format("{} x {} image", camera.width, camera.height);
  if (!camera.contains({k.cx, k.cy})) {
    warnings.push_back(point + " is outside of the " + image + ": was the camera calibrated at another resolution?");
  } else if (std::abs(k.cx / camera.width - 0.5) > kFarOff || std::abs(k.cy / camera.height - 0.5) > kFarOff) {
    warnings.push_back(point + " is far from the centre of the " + image + ": was it scaled or cropped?");
  }
}

void warn_of_lens(const camera::Camera& camera, std::size_t i, std::vector<std::string>& warnings) {
  constexpr double kNarrow = 8, kWide = 150, kMinValidFraction = 0.85, kSquare = 1.2;
  constexpr int kColumns = 24, kRows = 16;
  const camera::Intrinsics& k = camera::intrinsics(camera.model);
  const double ratio = std::max(k.fx / k.fy, k.fy / k.fx);
  if (ratio > kSquare) {
    warnings.push_back(fmt::format(
        "camera {}: focal lengths {:.1f} and {:.1f} differ unusually: are pixels not square?", i, k.fx, k.fy));
  }
  const double horizontal = degrees(field_of_view(camera).horizontal);
  const bool plane = std::holds_alternative<camera::Pinhole>(camera.model) ||
                     std::holds_alternative<camera::PinholeRadTan>(camera.model);
  if (horizontal < kNarrow || (plane && horizontal > kWide)) {
    warnings.push_back(
        fmt::format("camera {}: a field of view of {:.1f} deg: does the focal length fit {} x {} pixels?", i,
                    horizontal, camera.width, camera.height));
  }
  int answered = 0;
  for (int r = 0; r < kRows; ++r) {
    for (int c = 0; c < kColumns; ++c) {
      const Vector2d pixel((c + 0.5) * camera.width / kColumns - 0.5, (r + 0.5) * camera.height / kRows - 0.5);
      answered += camera.unproject(pixel) ? 1 : 0;
    }
  }
  const double valid_fraction = static_cast<double>(answered) / (kColumns * kRows);
  const double corners = plane ? kMinValidFraction : 0.5;  // large parts of a fisheye image may be dark
  if (valid_fraction < corners) {
    warnings.push_back(
        fmt::format("camera {}: the camera model is valid for only {:.0f} % of the image: are the coefficients "
                    "for model {}?",
                    i, 100 * valid_fraction, camera::model_name(camera.model)));
  }
}

void warn_of_time(const camera::Camera& camera, std::size_t i, std::vector<std::string>& warnings) {
  constexpr double kLong_s = 0.5;
  const double offset_s = to_seconds(camera.time_offset_ns);
  if (std::abs(offset_s) < kLong_s) return;
  warnings.push_back(fmt::format(
      "camera {}: a time offset of {:g} s: is it given in milliseconds? (seconds are expected)", i, offset_s));
}

constexpr double kSameWay = 0.5;  // radians; largest angle between similar viewing directions

// Whether there are cameras with similar viewing directions, and all of their baselines are along `axis` of the image
// (0: side by side, 1: above each other).
bool all_apart_along(const camera::Rig& rig, int axis) {
  constexpr double kAlong = 0.9;
  bool some = false;
  for (std::size_t i = 0; i < rig.size(); ++i) {
    for (std::size_t j = i + 1; j < rig.size(); ++j) {
      const Vector3d baseline = between(rig, i, j).translation();
      if (geometry::angle_between(axis_of(rig, i), axis_of(rig, j)) > kSameWay) continue;
      if (!(std::abs(baseline[axis]) > kAlong * baseline.norm())) return false;
      some = true;
    }
  }
  return some;
}

// Signs that the file contains T_cam_body instead of T_body_cam.
void warn_of_direction(const camera::Rig& rig, std::vector<std::string>& warnings) {
  constexpr double kInTheWay = 0.5, kOutOfTheWay = 0.25;
  constexpr const char* kQuestion = ": was T_cam_body given instead of T_body_cam?";
  const camera::Rig inverse = with_inverse_extrinsics(rig);
  const auto spread = [](const camera::Rig& r) {
    double most = 0.0;
    for (std::size_t i = 1; i < r.size(); ++i) most = std::max(most, r.rig_from_cam(i).translation().norm());
    return most;
  };
  if (rig.size() > 1 && spread(rig) < kMinBaseline && spread(inverse) > kMinBaseline) {
    warnings.push_back(std::string("all cameras are at the same position, but not with inverted transforms") +
                       kQuestion);
  } else if (obstruction(rig) > kInTheWay && obstruction(inverse) < kOutOfTheWay) {
    warnings.push_back(std::string("the cameras are in the view of each other, but not with inverted transforms") +
                       kQuestion);
  } else if (obstruction(rig) > kInTheWay) {
    warnings.push_back(
        "the cameras are in the view of each other: check the direction of transforms and the axes (x right, y down, z "
        "forward)");
  } else if (all_apart_along(rig, 1) && all_apart_along(inverse, 0)) {
    warnings.push_back(std::string("the cameras are above each other, but side by side with inverted transforms") +
                       kQuestion);
  }
}

// Cameras with similar viewing directions should be side by side, and others should face away from each other.
double pair_obstruction(const camera::Rig& rig, std::size_t i, std::size_t j) {
  const Vector3d baseline = rig.rig_from_cam(j).translation() - rig.rig_from_cam(i).translation();
  if (baseline.norm() < kMinBaseline) return 0.0;
  const Vector3d direction = baseline.normalized(), a = axis_of(rig, i), b = axis_of(rig, j);
  if (geometry::angle_between(a, b) < kSameWay) return std::abs(direction.dot((a + b).normalized()));
  return std::max(0.0, -direction.dot((b - a).normalized()));
}

}  // namespace

double obstruction(const camera::Rig& rig) {
  double sum = 0.0;
  int pairs = 0;
  for (std::size_t i = 0; i < rig.size(); ++i) {
    for (std::size_t j = i + 1; j < rig.size(); ++j, ++pairs) sum += pair_obstruction(rig, i, j);
  }
  return pairs > 0 ? sum / pairs : 0.0;
}

camera::Rig with_inverse_extrinsics(const camera::Rig& rig) {
  std::vector<camera::RigCamera> cameras;
  for (std::size_t i = 0; i < rig.size(); ++i) cameras.push_back({rig.camera(i), rig.body_from_cam(i).inverse()});
  return camera::Rig(std::move(cameras));
}

std::vector<std::string> rig_warnings(const camera::Rig& rig) {
  std::vector<std::string> warnings;
  for (std::size_t i = 0; i < rig.size(); ++i) {
    warn_of_principal_point(rig.camera(i), i, warnings);
    warn_of_lens(rig.camera(i), i, warnings);
    warn_of_time(rig.camera(i), i, warnings);
  }
  for (std::size_t i = 0; i < rig.size(); ++i) {
    for (std::size_t j = i + 1; j < rig.size(); ++j) warn_of_short_baseline(rig, i, j, warnings);
  }
  warn_of_long_baselines(rig, warnings);
  warn_of_direction(rig, warnings);
  return warnings;
}

std::string length_in_words(double metres) {
  if (metres >= 1.0) return fmt::format("{:.2f} m", metres);
  if (metres >= 0.01) return fmt::format("{:.1f} cm", 100 * metres);
  return fmt::format("{:.1f} mm", 1000 * metres);
}

}  // namespace bslam::calibration
