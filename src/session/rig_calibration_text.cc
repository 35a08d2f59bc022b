#include <fmt/format.h>

#include <array>
#include <cmath>

#include "camera/model_parameters.h"
#include "rig_formats/bslam_rig.h"
#include "session/rig_calibration.h"

namespace bslam::session {
namespace {

using calibration::CalibratedValue;

constexpr std::array kAxes = {'x', 'y', 'z'};
constexpr double kMillimetres = 1000.0;

// A line of the table.
struct Row {
  std::string name;
  double given = 0, estimate = 0, std = 0;
  std::string unit;
  bool observed = true;
};

std::string text_of(const Row& row) {
  // enough decimals for two digits of the standard deviation
  const int digits =
      row.std > 0 && row.std < 1 ? std::min(9, 1 - static_cast<int>(std::floor(std::log10(row.std)))) : 1;
  return fmt::format("  {:<14} {:>12.{}f} {:>12.{}f} {:>12.{}f} {:<3} {}\n", row.name, row.given, digits, row.estimate,
                     digits, row.std, digits, row.unit, row.observed ? "" : "not observed");
}

std::vector<Row> intrinsics_rows(const RigCalibration& c, std::size_t camera) {
  const camera::CameraModel& model = c.start.camera(camera).model;
  const std::vector<std::string> names = camera::parameter_names(model);
  const camera::ModelParameters given = camera::parameters(model);
  std::vector<Row> out;
  for (std::size_t k = 0; k < names.size(); ++k) {
    const CalibratedValue& value = c.joint.cameras[camera].intrinsics[k];
    const double before = given(static_cast<Eigen::Index>(k));
    out.push_back({names[k], before, before + value.change, value.std, k < 4 ? "px" : "", value.observed});
  }
  return out;
}

// The deviations of translations include that of the common scale, which the images do not determine.
std::vector<Row> extrinsics_rows(const RigCalibration& c, std::size_t camera) {
  const Eigen::Vector3d position = c.joint.rig.cam_from_rig(camera).translation();
  std::vector<Row> out;
  for (std::size_t k = 0; k < 6; ++k) {
    const CalibratedValue& value = c.joint.cameras[camera].extrinsics[k];
    const char axis = kAxes[k % 3];
    if (k < 3) {
      out.push_back({fmt::format("rotation {}", axis), 0, geometry::degrees(value.change), geometry::degrees(value.std),
                     "deg", value.observed});
    } else {
      const double std = std::hypot(value.std, c.scale_std * position(static_cast<Eigen::Index>(k - 3)));
      out.push_back({fmt::format("translation {}", axis), 0, kMillimetres * value.change, kMillimetres * std, "mm",
                     value.observed});
    }
  }
  return out;
}

// The meaning of a parameter of a camera model, and the motion with which the images determine it.
std::string missing_for_intrinsics(const std::string& name) {
  if (name == "fx")
    return "horizontal focal length of {} (needs rotation about its y axis, which moves points sideways)";
  if (name == "fy")
    return "vertical focal length of {} (needs rotation about its x axis, which moves points up and down)";
  if (name == "cx" || name == "cy")
    return "principal point " + name + " of {} (needs rotation about its optical axis, or about two axes)";
  return "distortion " + name + " of {} (needs points that move between the centre and the border of the image)";
}

std::string missing_for_extrinsics(std::size_t k) {
  if (k < 3)
    return fmt::format(
        "rotation of {{}} about its {} axis (needs rotation of the rig about another axis, or points that "
        "several cameras see)",
        kAxes[k]);
  return fmt::format(
      "translation of {{}} along its {} axis (needs near points that several cameras see, or rotation of "
      "the rig about two axes)",
      kAxes[k - 3]);
}

// Returns true if an axis of the second camera of a stereo pair is about parallel to its baseline. Motion does not help
// there, since the length of the baseline is the scale of the rig.
bool along_baseline(const camera::Rig& rig, std::size_t camera, std::size_t axis) {
  constexpr double kParallel = 0.9;  // cosine
  if (rig.size() != 2 || camera == 0) return false;
  const Eigen::Vector3d baseline = rig.in_frame_of_camera_0().cam_from_rig(camera).translation();
  return std::abs(baseline.normalized()(static_cast<Eigen::Index>(axis))) > kParallel;
}

std::string missing_text(const RigCalibration& c) {
  std::string out;
  const auto add = [&](const std::string& what, std::size_t camera) {
    out +=
        "not observable from these recordings: " + fmt::format(fmt::runtime(what), c.start.camera(camera).name) + "\n";
  };
  for (std::size_t i = 0; i < c.start.size(); ++i) {
    const std::vector<std::string> names = camera::parameter_names(c.start.camera(i).model);
    for (std::size_t k = 0; k < names.size(); ++k)
      if (!c.joint.cameras[i].intrinsics[k].observed) add(missing_for_intrinsics(names[k]), i);
    for (std::size_t k = 0; k < 6; ++k) {
      const bool is_scale = c.scale_std > 0 && k >= 3 && along_baseline(c.start, i, k - 3);  // reported below
      if (!c.joint.cameras[i].extrinsics[k].observed && !is_scale) add(missing_for_extrinsics(k), i);
    }
  }
  if (c.scale_std > 0)
    out += fmt::format(
        "not observable from any images: the common factor of all distances between the cameras. It is that of the "
        "start, "
        "with a standard deviation of {:.1f} %; to improve it, measure one distance and scale all translations.\n",
        100 * c.scale_std);
  if (!c.converged)
    out += "the estimate still changed by more than its standard deviations: run it again with its result\n";
  return out;
}

std::string moves_text(const RigCalibration& c) {
  std::string out;
  for (const auto& [recording, move, left_out] : c.moves)
    out += fmt::format("{}: moved relative to the others at about {:.1f} s of {}, by {:.2f} deg and {:.1f} mm; {}\n",
                       c.start.camera(move.camera).name, move.at_s, recording, move.change_deg, move.change_mm,
                       left_out ? "this recording is left out, since the others may show the rig before or after it"
                                : "the result is the rig before it: for the present one, use recordings that were "
                                  "made after it");
  return out;
}

}  // namespace

std::string calibration_text(const RigCalibration& c) {
  std::string out = fmt::format("  {:<14} {:>12} {:>12} {:>12}\n", "", "given", "estimate", "std dev");
  for (std::size_t i = 0; i < c.start.size(); ++i) {
    out += fmt::format("{} ({}{})\n", c.start.camera(i).name, camera::model_name(c.start.camera(i).model),
                       i == 0 ? "" : "; rotation and translation: change of the given pose, in the camera's axes");
    for (const Row& row : intrinsics_rows(c, i)) out += text_of(row);
    if (i == 0) continue;
    for (const Row& row : extrinsics_rows(c, i)) out += text_of(row);
  }
  return out + missing_text(c) + moves_text(c);
}

std::string calibrated_rig_yaml(const RigCalibration& c) {
  std::string out = "# Estimated from images.\n";
  const std::string text = calibration_text(c);
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = text.find('\n', begin);
    out += "# " + text.substr(begin, end - begin) + "\n";
    begin = end + 1;
  }
  return out + rig_formats::rig_to_yaml(c.whole, c.topics);
}

}  // namespace bslam::session
