#include "rig_formats/bslam_rig.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <set>
#include <utility>
#include <vector>

#include "base/number_text.h"
#include "base/timestamp.h"
#include "rig_formats/rig_limits.h"
#include "yaml/yaml_map.h"

namespace bslam::rig_formats {
namespace {

namespace fs = std::filesystem;

constexpr int kRigVersion = 1;

Status read_times_and_mask(const yaml::YamlMap& yaml, camera::CameraDescription& d) {
  if (yaml.has("time_offset_s")) {
    const auto offset = yaml.number("time_offset_s");
    if (!offset) return offset.error();
    d.time_offset_s = *offset;
  }
  if (yaml.has("rolling_shutter_readout_s")) {
    const auto readout = yaml.number("rolling_shutter_readout_s");
    if (!readout) return readout.error();
    d.readout_s = *readout;
  }
  if (yaml.has("mask")) {
    const auto mask = yaml.text("mask");
    if (!mask) return mask.error();
    // Paths in the file are relative to the rig file. They become absolute here, so that the rig can be written
    // elsewhere.
    d.mask_file = (fs::absolute(yaml.file()).parent_path() / *mask).lexically_normal().string();
  }
  return {};
}

// A camera with yaw, pitch and roll 0 looks along the x axis of the body with its image upright: x right = -y body,
// y down = -z body, z forward = x body.
geometry::Matrix3d looking_ahead() {
  geometry::Matrix3d R_body_cam;
  R_body_cam << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return R_body_cam;
}

Result<geometry::Matrix3d> read_rotation(const yaml::YamlMap& yaml) {
  const bool quaternion = yaml.has("quaternion_xyzw");
  const std::string key = quaternion ? "quaternion_xyzw" : "yaw_pitch_roll_deg";
  const auto values = yaml.numbers(key);
  if (!values) return values.error();
  const std::vector<double>& v = *values;
  if (v.size() != (quaternion ? 4 : 3))
    return yaml.error(key, fmt::format("{} numbers", v.size()), quaternion ? "4: x, y, z, w" : "3: yaw, pitch, roll");
  if (!quaternion) {
    constexpr double kRadians = std::numbers::pi / 180;
    using Eigen::AngleAxisd;
    return geometry::Matrix3d(AngleAxisd(kRadians * v[0], geometry::Vector3d::UnitZ()) *
                              AngleAxisd(kRadians * v[1], geometry::Vector3d::UnitY()) *
                              AngleAxisd(kRadians * v[2], geometry::Vector3d::UnitX()) * looking_ahead());
  }
  constexpr double kUnit = 1e-3;
  const geometry::Quaterniond q(v[3], v[0], v[1], v[2]);
  if (!(std::abs(q.norm() - 1) <= kUnit)) return yaml.error(key, fmt::format("the norm {:.6g}", q.norm()), "1");
  return q.normalized().toRotationMatrix();
}

// The pose of a camera on the body: a matrix, or a position with a quaternion or with angles.
Result<std::vector<double>> read_pose(const yaml::YamlMap& yaml) {
  const bool position = yaml.has("position"), quaternion = yaml.has("quaternion_xyzw"),
             angles = yaml.has("yaw_pitch_roll_deg");
  const int rotations = int{quaternion} + int{angles};
  if (yaml.has("T_body_cam") && (position || rotations > 0))
    return yaml.error("T_body_cam", "a second pose beside it", "T_body_cam alone, or position with a rotation");
  if (!position && rotations == 0) return yaml.rows("T_body_cam", 4);
  if (rotations != 1) {
    return yaml.error(rotations == 0 ? "position" : "quaternion_xyzw",
                      rotations == 0 ? "no rotation beside it" : "yaw_pitch_roll_deg beside it",
                      "one of quaternion_xyzw and yaw_pitch_roll_deg");
  }
  const auto at = yaml.numbers("position");
  if (!at) return at.error();
  if (at->size() != 3) return yaml.error("position", fmt::format("{} numbers", at->size()), "3: x, y, z in metres");
  const auto R = read_rotation(yaml);
  if (!R) return R.error();
  std::vector<double> rows;
  for (int r = 0; r < 3; ++r)
    rows.insert(rows.end(), {(*R)(r, 0), (*R)(r, 1), (*R)(r, 2), (*at)[static_cast<std::size_t>(r)]});
  rows.insert(rows.end(), {0, 0, 0, 1});
  return rows;
}

Result<camera::RigCamera> read_camera(const yaml::YamlMap& yaml, std::size_t index) {
  if (yaml.has("T_cam_body"))
    return yaml.error("T_cam_body", "the transform from body to camera", "T_body_cam, its inverse");
  const Status known = yaml.allow_only({"name", "model", "resolution", "intrinsics", "distortion", "T_body_cam",
                                        "position", "quaternion_xyzw", "yaw_pitch_roll_deg", "time_offset_s",
                                        "rolling_shutter_readout_s", "mask", "topic"});
  if (!known) return known.error();
  camera::CameraDescription d;
  d.name = fmt::format("cam{}", index);
  if (yaml.has("name")) {
    auto name = yaml.text("name");
    if (!name) return name.error();
    d.name = *std::move(name);
  }
  auto model = yaml.text("model");
  if (!model) return model.error();
  d.model = *std::move(model);
  const auto resolution = yaml.numbers("resolution");
  if (!resolution) return resolution.error();
  auto sides = camera::whole_pixels(*resolution, yaml.file(), yaml.key_path("resolution"));
  if (!sides) return sides.error();
  d.resolution = *std::move(sides);
  auto intrinsics = yaml.numbers("intrinsics");
  if (!intrinsics) return intrinsics.error();
  d.intrinsics = *std::move(intrinsics);
  if (yaml.has("distortion") || d.model != camera::Pinhole::kName) {
    auto distortion = yaml.numbers("distortion");
    if (!distortion) return distortion.error();
    d.distortion = *std::move(distortion);
  }
  auto T_body_cam = read_pose(yaml);
  if (!T_body_cam) return T_body_cam.error();
  d.T_body_cam = *std::move(T_body_cam);
  if (const Status status = read_times_and_mask(yaml, d); !status) return status.error();
  return camera::make_camera(d, {yaml.file(), yaml.key_path("model"), yaml.key_path("resolution"),
                                 yaml.key_path("intrinsics"), yaml.key_path("distortion"), yaml.key_path("T_body_cam"),
                                 yaml.key_path("time_offset_s"), yaml.key_path("rolling_shutter_readout_s")});
}

// The rotation of camera 0 in the rig frame, by a refined calibration.
Result<geometry::SE3> read_turn(const yaml::YamlMap& yaml) {
  constexpr const char* kKey = "T_cam0_rig";
  const auto rows = yaml.rows(kKey, 4);
  if (!rows) return rows.error();
  const auto T_cam0_rig = camera::rigid_transform(*rows, yaml.file(), yaml.key_path(kKey));
  if (!T_cam0_rig || T_cam0_rig->translation().isZero(0)) return T_cam0_rig;
  return yaml.error(kKey, "a translation", "a rotation: the frame has the origin of camera 0");
}

std::string transform_to_yaml(const geometry::SE3& transform, int indent) {
  const Eigen::Matrix4d T = transform.matrix();
  std::string yaml;
  for (int r = 0; r < 4; ++r)
    yaml += fmt::format("{:{}}- {}\n", "", indent, number_list({T(r, 0), T(r, 1), T(r, 2), T(r, 3)}));
  return yaml;
}

std::string camera_to_yaml(const camera::Camera& camera, const geometry::SE3& T_body_cam, const std::string& topic) {
  const camera::Intrinsics& k = camera::intrinsics(camera.model);
  std::string yaml =
      fmt::format("  - name: {}\n    model: {}\n    resolution: [{}, {}]\n", yaml::yaml_quoted(camera.name),
                  camera::model_name(camera.model), camera.width, camera.height);
  yaml += fmt::format("    intrinsics: {}  # fx fy cx cy\n", number_list({k.fx, k.fy, k.cx, k.cy}));
  yaml += fmt::format("    distortion: {}\n    T_body_cam:\n", number_list(camera::distortion(camera.model)));
  yaml += transform_to_yaml(T_body_cam, 6);
  // Divided instead of multiplied by 1e-9, since the quotient is the double closest to the decimal: its text is short
  // and exact.
  yaml += fmt::format("    time_offset_s: {}\n", format_double(static_cast<double>(camera.time_offset_ns) / 1e9));
  if (camera.readout_s != 0)
    yaml += fmt::format("    rolling_shutter_readout_s: {}\n", format_double(camera.readout_s));
  if (!topic.empty()) yaml += fmt::format("    topic: {}\n", yaml::yaml_quoted(topic));
  return yaml + fmt::format("    mask: {}\n", camera.mask_file.empty() ? "null" : yaml::yaml_quoted(camera.mask_file));
}

}  // namespace

Result<camera::RigReading> read_bslam_rig(const fs::path& file, const std::string& text) {
  const auto parsed = yaml::YamlMap::parse(file, text);
  if (!parsed) return parsed.error();
  const yaml::YamlMap& yaml = *parsed;
  if (const Status known = yaml.allow_only({"bslam_rig", "T_cam0_rig", "cameras"}); !known) return known.error();
  const auto version = yaml.integer("bslam_rig");
  if (!version) return version.error();
  if (*version != kRigVersion) return yaml.error("bslam_rig", std::to_string(*version), std::to_string(kRigVersion));
  const auto maps = yaml.maps("cameras");
  if (!maps) return maps.error();
  camera::RigReading reading;
  std::set<std::string> names;
  for (const yaml::YamlMap& map : *maps) {
    auto camera = read_camera(map, reading.cameras.size());
    if (!camera) return camera.error();
    if (!names.insert(camera->camera.name).second) {
      return map.error("name", camera->camera.name + " for a second camera", "a different name for each camera");
    }
    reading.cameras.push_back(*std::move(camera));
    const auto topic = map.has("topic") ? map.text("topic") : Result(std::string());
    if (!topic) return topic.error();
    reading.topics.push_back(*topic);
  }
  if (yaml.has("T_cam0_rig")) {
    const auto T_cam0_rig = read_turn(yaml);
    if (!T_cam0_rig) return T_cam0_rig.error();
    reading.T_cam0_rig = *T_cam0_rig;
  }
  return reading;
}

std::string rig_to_yaml(const camera::Rig& rig, const std::vector<std::string>& topics) {
  std::string yaml = fmt::format("bslam_rig: {}\n", kRigVersion);
  const geometry::SE3& T_cam0_rig = rig.cam_from_rig(0);
  if (!T_cam0_rig.matrix().isIdentity(0)) {
    yaml += "T_cam0_rig:  # A refined calibration has turned camera 0 in this frame, whose poses are reported.\n";
    yaml += transform_to_yaml(T_cam0_rig, 2);
  }
  yaml += "cameras:\n";
  for (std::size_t i = 0; i < rig.size(); ++i)
    yaml += camera_to_yaml(rig.camera(i), rig.body_from_cam(i), i < topics.size() ? topics[i] : "");
  return yaml;
}

}  // namespace bslam::rig_formats
