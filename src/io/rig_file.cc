#include "io/rig_file.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <set>
#include <string_view>
#include <utility>
#include <vector>

#include "base/number_text.h"
#include "base/timestamp.h"
#include "io/atomic_file.h"
#include "io/camera_description.h"
#include "io/euroc_sensor.h"
#include "io/kitti_calib.h"
#include "io/yaml_map.h"

namespace bslam::io {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxRigBytes = std::size_t{1} << 22;
constexpr int kRigVersion = 1;

// ---- our YAML

Status read_time_and_mask(const YamlMap& yaml, CameraDescription& d) {
  if (yaml.has("time_offset_s")) {
    const auto offset = yaml.number("time_offset_s");
    if (!offset) return offset.error();
    d.time_offset_s = *offset;
  }
  if (yaml.has("mask")) {
    const auto mask = yaml.text("mask");
    if (!mask) return mask.error();
    // Relative to the rig file, and absolute from here on, so that the rig may be written elsewhere.
    d.mask_file = (fs::absolute(yaml.file()).parent_path() / *mask).lexically_normal().string();
  }
  return {};
}

Result<camera::RigCamera> read_camera(const YamlMap& yaml, std::size_t index) {
  const Status known = yaml.allow_only(
      {"name", "model", "resolution", "intrinsics", "distortion", "T_body_cam", "time_offset_s", "mask"});
  if (!known) return known.error();
  CameraDescription d;
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
  for (const double side : *resolution) {
    const auto whole = static_cast<std::int64_t>(std::clamp(side, -1.0, 1e9));
    if (static_cast<double>(whole) != side) return yaml.error("resolution", format_double(side), "whole pixels");
    d.resolution.push_back(whole);
  }
  auto intrinsics = yaml.numbers("intrinsics");
  if (!intrinsics) return intrinsics.error();
  d.intrinsics = *std::move(intrinsics);
  if (yaml.has("distortion") || d.model != camera::Pinhole::kName) {
    auto distortion = yaml.numbers("distortion");
    if (!distortion) return distortion.error();
    d.distortion = *std::move(distortion);
  }
  auto T_body_cam = yaml.rows("T_body_cam", 4);
  if (!T_body_cam) return T_body_cam.error();
  d.T_body_cam = *std::move(T_body_cam);
  if (const Status status = read_time_and_mask(yaml, d); !status) return status.error();
  return make_camera(d, {yaml.file(), yaml.key_path("model"), yaml.key_path("resolution"), yaml.key_path("intrinsics"),
                         yaml.key_path("distortion"), yaml.key_path("T_body_cam"), yaml.key_path("time_offset_s")});
}

Result<camera::Rig> read_own(const YamlMap& yaml) {
  if (const Status known = yaml.allow_only({"bslam_rig", "cameras"}); !known) return known.error();
  const auto version = yaml.integer("bslam_rig");
  if (!version) return version.error();
  if (*version != kRigVersion) return yaml.error("bslam_rig", std::to_string(*version), std::to_string(kRigVersion));
  const auto maps = yaml.maps("cameras");
  if (!maps) return maps.error();
  std::vector<camera::RigCamera> cameras;
  std::set<std::string> names;
  for (const YamlMap& map : *maps) {
    auto camera = read_camera(map, cameras.size());
    if (!camera) return camera.error();
    if (!names.insert(camera->camera.name).second) {
      return map.error("name", camera->camera.name + " for a second camera", "a name of its own for every camera");
    }
    cameras.push_back(*std::move(camera));
  }
  return camera::Rig(std::move(cameras));
}

// ---- the closed list of formats a single file may have

Result<camera::Rig> read_own_file(const fs::path& file, const std::string& text) {
  const auto yaml = YamlMap::parse(file, text);
  if (!yaml) return yaml.error();
  return read_own(*yaml);
}

Result<camera::Rig> read_euroc_file(const fs::path& file, const std::string&) {
  const std::string folder = fs::absolute(file).parent_path().filename().string();
  auto camera = read_euroc_sensor(file, folder.starts_with("cam") ? folder : "cam0");
  if (!camera) return camera.error();
  return camera::Rig({*std::move(camera)});
}

Result<camera::Rig> read_kitti_file(const fs::path& file, const std::string&) {
  auto cameras = read_kitti_cameras(file);
  if (!cameras) return cameras.error();
  return camera::Rig(*std::move(cameras));
}

// True where some line begins with `key` and a colon.
bool has_line(std::string_view text, std::string_view key) {
  const std::string start = std::string(key) + ":";
  return text.starts_with(start) || text.find("\n" + start) != std::string_view::npos;
}

struct RigFormat {
  std::string_view name;
  bool (*recognises)(std::string_view text);
  Result<camera::Rig> (*read)(const fs::path& file, const std::string& text);
};

// The first that recognises a file reads it, so that an error speaks of the format that was meant.
constexpr std::array<RigFormat, 3> kFormats = {{
    {"a bslam rig (bslam_rig: 1)", [](std::string_view t) { return has_line(t, "bslam_rig"); }, read_own_file},
    {"an EuRoC sensor.yaml", [](std::string_view t) { return has_line(t, "T_BS") || has_line(t, "camera_model"); },
     read_euroc_file},
    {"a KITTI calib.txt", [](std::string_view t) { return has_line(t, "P0") || has_line(t, "P1"); }, read_kitti_file},
}};

Result<camera::Rig> read_folder(const fs::path& folder) {
  std::vector<camera::RigCamera> cameras;
  for (const fs::path& camera_folder : camera_folders(euroc_root(folder), "sensor.yaml")) {
    auto camera = read_euroc_sensor(camera_folder / "sensor.yaml", camera_folder.filename().string());
    if (!camera) return camera.error();
    cameras.push_back(*std::move(camera));
  }
  if (!cameras.empty()) return camera::Rig(std::move(cameras));
  std::error_code error;
  if (fs::exists(folder / "calib.txt", error)) return read_kitti_file(folder / "calib.txt", "");
  return Error{folder.string(), "", "a folder without calibration", "mav0/camN/sensor.yaml or calib.txt in it"};
}

// ---- out

std::string list_text(const std::vector<double>& values) {
  std::vector<std::string> texts;
  for (const double value : values) texts.push_back(format_double(value));
  return fmt::format("[{}]", fmt::join(texts, ", "));
}

std::string camera_to_yaml(const camera::Camera& camera, const geometry::SE3& T_body_cam) {
  const camera::Intrinsics& k = camera::intrinsics(camera.model);
  std::string yaml = fmt::format("  - name: {}\n    model: {}\n    resolution: [{}, {}]\n", yaml_quoted(camera.name),
                                 camera::model_name(camera.model), camera.width, camera.height);
  yaml += fmt::format("    intrinsics: {}  # fx fy cx cy\n", list_text({k.fx, k.fy, k.cx, k.cy}));
  yaml += fmt::format("    distortion: {}\n    T_body_cam:\n", list_text(camera::distortion(camera.model)));
  const Eigen::Matrix4d T = T_body_cam.matrix();
  for (int r = 0; r < 4; ++r) yaml += fmt::format("      - {}\n", list_text({T(r, 0), T(r, 1), T(r, 2), T(r, 3)}));
  // Divided, not multiplied by 1e-9: the quotient is the double nearest to the decimal, so its text is short and exact.
  yaml += fmt::format("    time_offset_s: {}\n", format_double(static_cast<double>(camera.time_offset_ns) / 1e9));
  return yaml + fmt::format("    mask: {}\n", camera.mask_file.empty() ? "null" : yaml_quoted(camera.mask_file));
}

}  // namespace

Result<camera::Rig> read_rig(const fs::path& path) {
  std::error_code error;
  if (fs::is_directory(path, error)) return read_folder(path);
  const auto text = read_file(path, kMaxRigBytes);
  if (!text) return text.error();
  std::string names;
  for (const RigFormat& format : kFormats) {
    if (format.recognises(*text)) return format.read(path, *text);
    names += (names.empty() ? "" : ", ") + std::string(format.name);
  }
  // Broken YAML is more worth saying than an unknown format.
  if (const auto yaml = YamlMap::parse(path, *text); !yaml && !yaml.error().key.empty()) return yaml.error();
  return Error{path.string(), "", "no rig of a known format", "one of: " + names};
}

std::string rig_to_yaml(const camera::Rig& rig) {
  std::string yaml = fmt::format("bslam_rig: {}\ncameras:\n", kRigVersion);
  for (std::size_t i = 0; i < rig.size(); ++i) yaml += camera_to_yaml(rig.camera(i), rig.body_from_cam(i));
  return yaml;
}

Status write_rig(const camera::Rig& rig, const fs::path& file) { return write_atomically(file, rig_to_yaml(rig)); }

}  // namespace bslam::io
