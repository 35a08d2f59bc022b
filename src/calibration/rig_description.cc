#include "calibration/rig_description.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "base/timestamp.h"
#include "calibration/rig_warnings.h"
#include "geometry/triangulation.h"

namespace bslam::calibration {
namespace {

using geometry::degrees;
using geometry::SE3;
using geometry::Vector2d;
using geometry::Vector3d;

// Angle between the optical axis and the last pixel with a valid bearing on the line from the principal point to
// `pixel`.
double angle_towards(const camera::Camera& camera, const Vector2d& pixel) {
  constexpr int kSteps = 256;
  const camera::Intrinsics& k = camera::intrinsics(camera.model);
  const Vector2d centre(k.cx, k.cy);
  for (int step = kSteps; step > 0; --step) {
    const Vector2d at = centre + (pixel - centre) * step / kSteps;
    if (const auto bearing = camera.unproject(at)) return geometry::angle_between(Vector3d::UnitZ(), *bearing);
  }
  return 0.0;
}

double span(const camera::Camera& camera, const Vector2d& from, const Vector2d& to) {
  return angle_towards(camera, from) + angle_towards(camera, to);
}

std::string vector_text(const Vector3d& v) {
  std::array<double, 3> shown{};
  for (int i = 0; i < 3; ++i) shown[static_cast<std::size_t>(i)] = std::abs(v[i]) < 5e-5 ? 0.0 : v[i];  // no "-0.0000"
  return fmt::format("({:.4f}, {:.4f}, {:.4f})", shown[0], shown[1], shown[2]);
}

// The rotation about the optical axis after panning and tilting the camera from the direction of camera 0, clockwise in
// degrees as seen by the camera; 0 if it looks straight up or down, where it is not defined.
double roll_of(const geometry::Matrix3d& R_rig_cam) {
  constexpr double kVertical = 0.02;  // cosine of the tilt
  const double cos_roll = R_rig_cam(1, 1), sin_roll = R_rig_cam(1, 0);
  return std::hypot(cos_roll, sin_roll) < kVertical ? 0.0 : degrees(std::atan2(sin_roll, cos_roll));
}

// The direction of the optical axis and the rotation about it, seen from camera 0.
std::string direction_in_words(const geometry::Matrix3d& R_rig_cam) {
  const Vector3d axis = R_rig_cam.col(2);
  constexpr double kStraight = 1.0;  // degrees
  const double right = degrees(std::atan2(axis.x(), axis.z()));
  const double down = degrees(std::asin(std::clamp(axis.y(), -1.0, 1.0)));
  std::vector<std::string> words;
  if (std::abs(right) >= kStraight) {
    words.push_back(fmt::format("{:.1f} deg to the {}", std::abs(right), right > 0 ? "right" : "left"));
  }
  if (std::abs(down) >= kStraight)
    words.push_back(fmt::format("{:.1f} deg {}", std::abs(down), down > 0 ? "down" : "up"));
  std::string text = words.empty() ? "same viewing direction" : fmt::format("looks {}", fmt::join(words, ", "));
  const double roll = roll_of(R_rig_cam);
  if (std::abs(roll) >= 179.5) return text + ", rolled 180.0 deg (its image is upside down)";
  if (std::abs(roll) >= kStraight)
    text += fmt::format(", rolled {:.1f} deg {}", std::abs(roll), roll > 0 ? "clockwise" : "counter-clockwise");
  return text;
}

// `from_camera_0`: the rig in the frame of its camera 0.
std::string describe_camera(const camera::Rig& rig, const camera::Rig& from_camera_0, std::size_t i) {
  const camera::Camera& camera = rig.camera(i);
  const camera::Intrinsics& k = camera::intrinsics(camera.model);
  const FieldOfView view = field_of_view(camera);
  const SE3& T_body_cam = rig.body_from_cam(i);
  std::string text =
      fmt::format("camera {}: {}\n  {}, {} x {} px, focal length {:.1f} {:.1f} px, centre {:.1f} {:.1f} px\n", i,
                  camera.name, camera::model_name(camera.model), camera.width, camera.height, k.fx, k.fy, k.cx, k.cy);
  text += fmt::format("  field of view {:.1f} deg horizontal, {:.1f} deg vertical, {:.1f} deg diagonal\n",
                      degrees(view.horizontal), degrees(view.vertical), degrees(view.diagonal));
  text += fmt::format("  in the body frame: at {} m, optical axis {}\n", vector_text(T_body_cam.translation()),
                      vector_text(T_body_cam.rotation() * Vector3d::UnitZ()));
  if (i > 0) {
    const SE3& T_cam0_cam = from_camera_0.rig_from_cam(i);
    text += fmt::format("  from camera 0: {}; {}\n", displacement_in_words(T_cam0_cam.translation()),
                        direction_in_words(T_cam0_cam.matrix3()));
  }
  if (camera.time_offset_ns != 0) text += fmt::format("  time offset {:.6f} s\n", to_seconds(camera.time_offset_ns));
  if (camera.readout_s != 0) text += fmt::format("  rolling shutter, readout {:.6f} s\n", camera.readout_s);
  if (!camera.mask_file.empty()) text += fmt::format("  mask {}\n", camera.mask_file);
  return text;
}

double baseline(const camera::Rig& rig, std::size_t i, std::size_t j) {
  return (rig.rig_from_cam(i).translation() - rig.rig_from_cam(j).translation()).norm();
}

std::string overlap_table(const camera::Rig& rig) {
  std::string text =
      "overlap: percentage of the view of the camera in the row that the camera in the column also observes\n        ";
  for (std::size_t j = 0; j < rig.size(); ++j) text += fmt::format("{:>5}", j);
  for (std::size_t i = 0; i < rig.size(); ++i) {
    text += fmt::format("\n  {:>6}", i);
    for (std::size_t j = 0; j < rig.size(); ++j) {
      text += i == j ? "    -" : fmt::format("{:>5.0f}", 100 * rig.overlap_share(i, j));
    }
  }
  return text + "\n";
}

}  // namespace

FieldOfView field_of_view(const camera::Camera& camera) {
  const camera::Intrinsics& k = camera::intrinsics(camera.model);
  const double right = camera.width - 1, bottom = camera.height - 1;
  return {span(camera, {0, k.cy}, {right, k.cy}), span(camera, {k.cx, 0}, {k.cx, bottom}),
          std::max(span(camera, {0, 0}, {right, bottom}), span(camera, {0, bottom}, {right, 0}))};
}

std::string displacement_in_words(const Vector3d& displacement) {
  struct Axis {
    double along;
    const char *positive, *negative;
  };
  std::array<Axis, 3> axes = {{{displacement.x(), "to the right", "to the left"},
                               {displacement.y(), "below", "above"},
                               {displacement.z(), "in front", "behind"}}};
  std::stable_sort(axes.begin(), axes.end(),
                   [](const Axis& a, const Axis& b) { return std::abs(a.along) > std::abs(b.along); });
  const double min_length =
      std::max(1e-4, 0.01 * displacement.norm());  // smaller components are noise of the calibration
  std::vector<std::string> words;
  for (const Axis& axis : axes) {
    if (std::abs(axis.along) < min_length) continue;
    words.push_back(length_in_words(std::abs(axis.along)) + " " + (axis.along > 0 ? axis.positive : axis.negative));
  }
  return words.empty() ? "at the same position" : fmt::format("{}", fmt::join(words, ", "));
}

std::string describe_rig(const camera::Rig& rig) {
  std::string text = fmt::format("{} camera{}\n", rig.size(), rig.size() == 1 ? "" : "s");
  const camera::Rig from_camera_0 = rig.in_frame_of_camera_0();
  for (std::size_t i = 0; i < rig.size(); ++i) text += describe_camera(rig, from_camera_0, i);
  if (rig.size() == 1) return text;
  text += "baselines:\n";
  for (std::size_t i = 0; i < rig.size(); ++i) {
    for (std::size_t j = i + 1; j < rig.size(); ++j) {
      text += fmt::format("  {} to {}: {}\n", i, j, length_in_words(baseline(rig, i, j)));
    }
  }
  return text + overlap_table(rig);
}

}  // namespace bslam::calibration
