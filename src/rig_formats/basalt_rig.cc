#include "rig_formats/basalt_rig.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include "base/number_text.h"
#include "base/timestamp.h"
#include "rig_formats/rig_limits.h"
#include "yaml/yaml_map.h"

namespace bslam::rig_formats {
namespace {

namespace fs = std::filesystem;

// A camera_type, the model of bslam, and the names of the parameters besides fx fy cx cy, in the order of bslam.
struct BasaltModel {
  std::string_view type, model;
  std::vector<std::string> names;
};

const std::vector<BasaltModel>& basalt_models() {
  static const std::vector<BasaltModel> models = {
      {"pinhole", camera::Pinhole::kName, {}},
      {"pinhole-radtan8", camera::PinholeRadTan::kName, {"k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"}},
      {"kb4", camera::KannalaBrandt::kName, {"k1", "k2", "k3", "k4"}},
      {"ucm", camera::Unified::kName, {"alpha"}},
      {"eucm", camera::ExtendedUnified::kName, {"alpha", "beta"}},
      {"ds", camera::DoubleSphere::kName, {"xi", "alpha"}}};
  return models;
}

Result<std::vector<double>> named_numbers(const yaml::YamlMap& yaml, const std::vector<std::string>& names) {
  std::vector<double> numbers;
  for (const std::string& name : names) {
    const auto number = yaml.number(name);
    if (!number) return number.error();
    numbers.push_back(*number);
  }
  return numbers;
}

Status read_model(const yaml::YamlMap& yaml, camera::CameraDescription& d) {
  const auto type = yaml.text("camera_type");
  if (!type) return type.error();
  const auto& models = basalt_models();
  const auto model = std::find_if(models.begin(), models.end(), [&](const BasaltModel& m) { return m.type == *type; });
  if (model == models.end()) {
    return yaml.error("camera_type", *type, "one of: pinhole, pinhole-radtan8, kb4, ucm, eucm, ds");
  }
  const auto numbers = yaml.map("intrinsics");
  if (!numbers) return numbers.error();
  auto intrinsics = named_numbers(*numbers, {"fx", "fy", "cx", "cy"});
  if (!intrinsics) return intrinsics.error();
  auto shape = named_numbers(*numbers, model->names);
  if (!shape) return shape.error();
  d.model = model->model;
  d.intrinsics = *std::move(intrinsics);
  d.distortion = *std::move(shape);
  if (d.model == camera::PinholeRadTan::kName) {  // files without the rational coefficients set them to zero
    d.distortion = needed_coefficients(camera::PinholeRadTan({}, d.distortion));
  }
  return {};
}

Result<geometry::SE3> read_place(const yaml::YamlMap& yaml) {
  const auto p = named_numbers(yaml, {"px", "py", "pz"});
  if (!p) return p.error();
  const auto q = named_numbers(yaml, {"qx", "qy", "qz", "qw"});
  if (!q) return q.error();
  std::string key = yaml.key_path("");
  key.pop_back();
  return camera::rigid_transform(geometry::Quaterniond((*q)[3], (*q)[0], (*q)[1], (*q)[2]), {(*p)[0], (*p)[1], (*p)[2]},
                                 yaml.file(), key);
}

Result<std::vector<std::int64_t>> read_resolution(const yaml::YamlMap& yaml, std::size_t i) {
  const YAML::Node entry = yaml.node()["resolution"][i];
  std::vector<double> sides;
  for (const YAML::Node& side : entry) {
    const auto value = side.IsScalar() ? parse_double(side.Scalar()) : std::nullopt;
    if (!value) return yaml.error(fmt::format("resolution[{}]", i), yaml::describe(side), "width and height");
    sides.push_back(*value);
  }
  return camera::whole_pixels(sides, yaml.file(), yaml.key_path(fmt::format("resolution[{}]", i)));
}

std::string camera_text(const camera::Camera& camera) {
  const auto& models = basalt_models();
  const auto model = std::find_if(models.begin(), models.end(),
                                  [&](const BasaltModel& m) { return m.model == camera::model_name(camera.model); });
  const camera::Intrinsics& k = camera::intrinsics(camera.model);
  std::string numbers = fmt::format("\"fx\": {}, \"fy\": {}, \"cx\": {}, \"cy\": {}", format_double(k.fx),
                                    format_double(k.fy), format_double(k.cx), format_double(k.cy));
  std::vector<double> shape = camera::distortion(camera.model);
  shape.resize(model->names.size(), 0.0);
  for (std::size_t i = 0; i < shape.size(); ++i) {
    numbers += fmt::format(", \"{}\": {}", model->names[i], format_double(shape[i]));
  }
  if (model->type == "pinhole-radtan8") numbers += ", \"rpmax\": 0.0";  // 0: no limit of the radius
  return fmt::format("      {{\"camera_type\": \"{}\", \"intrinsics\": {{{}}}}}", model->type, numbers);
}

std::string place_text(const geometry::SE3& T) {
  const geometry::Vector3d& p = T.translation();
  const geometry::Quaterniond& q = T.rotation();
  return fmt::format("      {{\"px\": {}, \"py\": {}, \"pz\": {}, \"qx\": {}, \"qy\": {}, \"qz\": {}, \"qw\": {}}}",
                     format_double(p.x()), format_double(p.y()), format_double(p.z()), format_double(q.x()),
                     format_double(q.y()), format_double(q.z()), format_double(q.w()));
}

}  // namespace

Result<camera::RigReading> read_basalt_rig(const fs::path& file, const std::string& text) {
  std::string spaced = text;  // JSON is valid YAML except for tabs
  std::replace(spaced.begin(), spaced.end(), '\t', ' ');
  const auto root = yaml::YamlMap::parse(file, std::move(spaced));
  if (!root) return root.error();
  const auto yaml = root->map("value0");
  if (!yaml) return yaml.error();
  const auto places = yaml->maps("T_imu_cam"), models = yaml->maps("intrinsics");
  if (!places) return places.error();
  if (!models) return models.error();
  if (!yaml->has("resolution")) return yaml->error("resolution", "nothing", "width and height of every camera");
  for (const auto& [key, size] :
       {std::pair("intrinsics", models->size()), std::pair("resolution", yaml->node()["resolution"].size())}) {
    if (size != places->size()) {
      return yaml->error(key, fmt::format("{} entries", size),
                         fmt::format("{}, the number of entries of T_imu_cam", places->size()));
    }
  }
  double offset_s = 0.0;
  if (yaml->has("cam_time_offset_ns")) {
    const auto offset_ns = yaml->integer("cam_time_offset_ns");
    if (!offset_ns) return offset_ns.error();
    offset_s = static_cast<double>(*offset_ns) / 1e9;
  }
  camera::RigReading reading;
  for (std::size_t i = 0; i < places->size(); ++i) {
    camera::CameraDescription d;
    d.name = fmt::format("cam{}", i);
    d.time_offset_s = offset_s;
    if (const Status status = read_model((*models)[i], d); !status) return status.error();
    auto resolution = read_resolution(*yaml, i);
    if (!resolution) return resolution.error();
    d.resolution = *std::move(resolution);
    const auto T_body_cam = read_place((*places)[i]);
    if (!T_body_cam) return T_body_cam.error();
    d.T_body_cam = camera::rows_of(*T_body_cam);
    const std::string intrinsics = (*models)[i].key_path("intrinsics");
    auto camera = camera::make_camera(
        d, {file.string(), (*models)[i].key_path("camera_type"), fmt::format("value0.resolution[{}]", i), intrinsics,
            intrinsics, fmt::format("value0.T_imu_cam[{}]", i), "value0.cam_time_offset_ns"});
    if (!camera) return camera.error();
    reading.cameras.push_back(*std::move(camera));
  }
  return reading;
}

Result<std::string> basalt_rig_text(const camera::Rig& rig, const std::string& out) {
  RigLimits limits{.format = "Basalt's calibration", .models = {}, .time_offsets = Supports::kOneForAll};
  for (const BasaltModel& model : basalt_models()) limits.models.push_back(model.model);
  if (const Status status = check_limits(rig, out, limits); !status) return status.error();
  std::vector<std::string> places, models, sides;
  for (std::size_t i = 0; i < rig.size(); ++i) {
    places.push_back(place_text(rig.body_from_cam(i)));
    models.push_back(camera_text(rig.camera(i)));
    sides.push_back(fmt::format("[{}, {}]", rig.camera(i).width, rig.camera(i).height));
  }
  const auto zeros = [](std::size_t count) { return number_list(std::vector<double>(count, 0.0)); };
  return fmt::format(
      "{{\n  \"value0\": {{\n    \"T_imu_cam\": [\n{}\n    ],\n    \"intrinsics\": [\n{}\n    ],\n"
      "    \"resolution\": [{}],\n    \"calib_accel_bias\": {},\n    \"calib_gyro_bias\": {},\n"
      "    \"imu_update_rate\": 0.0,\n    \"accel_noise_std\": {},\n    \"gyro_noise_std\": {},\n"
      "    \"accel_bias_std\": {},\n    \"gyro_bias_std\": {},\n    \"cam_time_offset_ns\": {},\n"
      "    \"vignette\": []\n  }}\n}}\n",
      fmt::join(places, ",\n"), fmt::join(models, ",\n"), fmt::join(sides, ", "), zeros(9), zeros(12), zeros(3),
      zeros(3), zeros(3), zeros(3), rig.camera(std::size_t{0}).time_offset_ns);
}

}  // namespace bslam::rig_formats
