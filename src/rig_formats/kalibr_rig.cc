#include "rig_formats/kalibr_rig.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "base/number_text.h"
#include "base/timestamp.h"
#include "rig_formats/rig_limits.h"
#include "yaml/yaml_map.h"

namespace bslam::rig_formats {
namespace {

namespace fs = std::filesystem;
using geometry::SE3;

// A camera model of Kalibr: the number of values in `intrinsics` and their names.
struct KalibrModel {
  std::string_view name;
  std::size_t count;
  std::string_view order;
};
constexpr std::array<KalibrModel, 4> kModels = {{{"pinhole", 4, "fu fv pu pv"},
                                                 {"omni", 5, "xi fu fv pu pv"},
                                                 {"eucm", 6, "alpha beta fu fv pu pv"},
                                                 {"ds", 6, "xi alpha fu fv pu pv"}}};

// The distortion models of a pinhole camera, and the models of bslam.
struct KalibrDistortion {
  std::string_view name, model;
};
constexpr std::array<KalibrDistortion, 4> kDistortions = {{{"none", camera::Pinhole::kName},
                                                           {"radtan", camera::PinholeRadTan::kName},
                                                           {"equidistant", camera::KannalaBrandt::kName},
                                                           {"fov", camera::Fov::kName}}};

Result<std::vector<double>> read_coefficients(const yaml::YamlMap& yaml, const std::string& distortion_model) {
  if (distortion_model == "none" && !yaml.has("distortion_coeffs")) return std::vector<double>();
  auto coefficients = yaml.numbers("distortion_coeffs");
  if (!coefficients) return coefficients.error();
  const bool zero = std::all_of(coefficients->begin(), coefficients->end(), [](double v) { return v == 0; });
  if (distortion_model == "none" && zero) return std::vector<double>();
  return coefficients;
}

Status read_pinhole(const yaml::YamlMap& yaml, const std::string& distortion_model, camera::CameraDescription& d) {
  const auto* distortion = std::ranges::find(kDistortions, distortion_model, &KalibrDistortion::name);
  if (distortion == kDistortions.end()) {
    std::vector<std::string_view> names;
    for (const KalibrDistortion& known : kDistortions) names.push_back(known.name);
    return yaml.error("distortion_model", distortion_model, fmt::format("one of: {}", fmt::join(names, ", ")));
  }
  d.model = distortion->model;
  return {};
}

// The sphere models accept no distortion, except for coefficients that are all 0.
Status read_sphere(const yaml::YamlMap& yaml, const KalibrModel& model, const std::vector<double>& numbers,
                   camera::CameraDescription& d) {
  if (std::any_of(d.distortion.begin(), d.distortion.end(), [](double v) { return v != 0; })) {
    return yaml.error(
        "distortion_coeffs", fmt::format("{} with distortion", model.name),
        fmt::format("{} without distortion (calibrate again as ds-none, eucm-none or pinhole-equi)", model.name));
  }
  if (model.name == "omni") {  // the model of Mei with parameter xi: m = (x, y) / (z + xi |p|)
    const double xi = numbers[0];
    if (!(xi >= 0)) return yaml.error("intrinsics", fmt::format("xi {}", xi), "xi >= 0");
    d.model = camera::Unified::kName;
    d.distortion = {xi / (1 + xi)};
    d.intrinsics[0] /= 1 + xi;
    d.intrinsics[1] /= 1 + xi;
  } else {
    d.model = model.name == "ds" ? camera::DoubleSphere::kName : camera::ExtendedUnified::kName;
    d.distortion = {numbers[0], numbers[1]};
  }
  return {};
}

Status read_model(const yaml::YamlMap& yaml, camera::CameraDescription& d) {
  const auto name = yaml.text("camera_model");
  if (!name) return name.error();
  const auto* model =
      std::find_if(kModels.begin(), kModels.end(), [&](const KalibrModel& m) { return m.name == *name; });
  if (model == kModels.end()) return yaml.error("camera_model", *name, "one of: pinhole, omni, eucm, ds");
  const auto numbers = yaml.numbers("intrinsics");
  if (!numbers) return numbers.error();
  if (numbers->size() != model->count) {
    return yaml.error("intrinsics", fmt::format("{} numbers", numbers->size()),
                      fmt::format("{} for {}: {}", model->count, model->name, model->order));
  }
  d.intrinsics.assign(numbers->end() - 4, numbers->end());
  std::string distortion_model = "none";
  if (yaml.has("distortion_model")) {
    const auto text = yaml.text("distortion_model");
    if (!text) return text.error();
    distortion_model = *text;
  }
  auto coefficients = read_coefficients(yaml, distortion_model);
  if (!coefficients) return coefficients.error();
  d.distortion = *std::move(coefficients);
  return model->name == "pinhole" ? read_pinhole(yaml, distortion_model, d) : read_sphere(yaml, *model, *numbers, d);
}

Result<SE3> transform(const yaml::YamlMap& yaml, const char* key) {
  const auto rows = yaml.rows(key, 4);
  if (!rows) return rows.error();
  return camera::rigid_transform(*rows, yaml.file(), yaml.key_path(key));
}

Result<std::optional<SE3>> body_from_camera(const yaml::YamlMap& yaml) {
  if (yaml.has("T_imu_cam")) {
    const auto T_imu_cam = transform(yaml, "T_imu_cam");
    if (!T_imu_cam) return T_imu_cam.error();
    return std::optional(*T_imu_cam);
  }
  if (!yaml.has("T_cam_imu")) return std::optional<SE3>();
  const auto T_cam_imu = transform(yaml, "T_cam_imu");
  if (!T_cam_imu) return T_cam_imu.error();
  return std::optional(T_cam_imu->inverse());
}

// Two transforms given for one camera may only differ by rounding.
bool agree(const SE3& a, const SE3& b) {
  constexpr double kMetres = 0.01, kRadians = 0.01;
  const SE3 difference = a.inverse() * b;
  return difference.translation().norm() < kMetres && geometry::so3_log(difference.rotation()).norm() < kRadians;
}

// Returns T_body_cam of camera n. `before` is T_body_cam of camera n - 1.
Result<SE3> place_of(const yaml::YamlMap& yaml, const std::optional<SE3>& before) {
  const auto of_body = body_from_camera(yaml);
  if (!of_body) return of_body.error();
  if (!before) return of_body->value_or(SE3());
  if (*of_body && !yaml.has("T_cn_cnm1")) return **of_body;
  const auto T_cn_cnm1 = transform(yaml, "T_cn_cnm1");
  if (!T_cn_cnm1) return T_cn_cnm1.error();
  const SE3 by_chain = *before * T_cn_cnm1->inverse();
  if (!*of_body) return by_chain;
  if (!agree(**of_body, by_chain)) {
    return yaml.error("T_cn_cnm1", "a camera pose that differs from T_cam_imu",
                      "consistent transforms T_cn_cnm1 (camera n-1 to camera n) and T_cam_imu (IMU to camera)");
  }
  return **of_body;
}

Result<camera::RigCamera> read_camera(const yaml::YamlMap& yaml, const std::string& name, const SE3& T_body_cam) {
  camera::CameraDescription d;
  d.name = name;
  if (const Status status = read_model(yaml, d); !status) return status.error();
  const auto sides = yaml.numbers("resolution");
  if (!sides) return sides.error();
  auto resolution = camera::whole_pixels(*sides, yaml.file(), yaml.key_path("resolution"));
  if (!resolution) return resolution.error();
  d.resolution = *std::move(resolution);
  d.T_body_cam = camera::rows_of(T_body_cam);
  if (yaml.has("timeshift_cam_imu")) {
    const auto shift = yaml.number("timeshift_cam_imu");
    if (!shift) return shift.error();
    d.time_offset_s = *shift;
  }
  return camera::make_camera(
      d, {yaml.file(), yaml.key_path("camera_model"), yaml.key_path("resolution"), yaml.key_path("intrinsics"),
          yaml.key_path("distortion_coeffs"), yaml.key_path("T_cam_imu"), yaml.key_path("timeshift_cam_imu")});
}

// Functions for writing.

struct KalibrNumbers {
  std::string_view model, distortion_model;
  std::vector<double> intrinsics, coefficients;
};

KalibrNumbers numbers_of(const camera::CameraModel& model) {
  const camera::Intrinsics& k = camera::intrinsics(model);
  const std::vector<double> d = needed_coefficients(model);
  if (std::holds_alternative<camera::Unified>(model)) {
    const double xi = d[0] / (1 - d[0]);
    return {"omni", "none", {xi, k.fx * (1 + xi), k.fy * (1 + xi), k.cx, k.cy}, {}};
  }
  if (std::holds_alternative<camera::ExtendedUnified>(model)) {
    return {"eucm", "none", {d[0], d[1], k.fx, k.fy, k.cx, k.cy}, {}};
  }
  if (std::holds_alternative<camera::DoubleSphere>(model)) {
    return {"ds", "none", {d[0], d[1], k.fx, k.fy, k.cx, k.cy}, {}};
  }
  const auto* distortion = std::ranges::find(kDistortions, camera::model_name(model), &KalibrDistortion::model);
  return {"pinhole", distortion->name, {k.fx, k.fy, k.cx, k.cy}, d};
}

std::string transform_text(const char* key, const SE3& T) {
  const std::vector<double> m = camera::rows_of(T);
  std::string text = fmt::format("  {}:\n", key);
  for (auto row = m.begin(); row != m.end(); row += 4) text += fmt::format("  - {}\n", number_list({row, row + 4}));
  return text;
}

std::string camera_text(const camera::Rig& rig, std::size_t i, const KalibrNumbers& numbers,
                        const std::vector<std::string>& topics) {
  const camera::Camera& camera = rig.camera(i);
  std::vector<std::size_t> overlaps;
  for (std::size_t j = 0; j < rig.size(); ++j) {
    if (j != i && rig.overlap(i, j)) overlaps.push_back(j);
  }
  const bool has_topic = i < topics.size() && !topics[i].empty();
  return fmt::format(
      "  cam_overlaps: [{}]\n  camera_model: {}\n  distortion_coeffs: {}\n  distortion_model: {}\n  intrinsics: {}\n"
      "  resolution: [{}, {}]\n  rostopic: {}\n  timeshift_cam_imu: {}\n",
      fmt::join(overlaps, ", "), numbers.model, number_list(numbers.coefficients), numbers.distortion_model,
      number_list(numbers.intrinsics), camera.width, camera.height,
      has_topic ? yaml::yaml_quoted(topics[i]) : fmt::format("/cam{}/image_raw", i),
      format_double(static_cast<double>(camera.time_offset_ns) / 1e9));
}

}  // namespace

Result<camera::RigReading> read_kalibr_rig(const fs::path& file, const std::string& text) {
  const auto yaml = yaml::YamlMap::parse(file, text);
  if (!yaml) return yaml.error();
  camera::RigReading reading;
  std::optional<SE3> before;
  bool imu = false;
  for (std::string name = "cam0"; yaml->has(name); name = fmt::format("cam{}", reading.cameras.size())) {
    const auto map = yaml->map(name);
    if (!map) return map.error();
    const bool has_imu = map->has("T_imu_cam") || map->has("T_cam_imu");
    if (before && has_imu && !imu)
      return yaml->error("cam0.T_cam_imu", "nothing", "T_cam_imu for every camera, since " + name + " has it");
    imu = has_imu || imu;
    const auto T_body_cam = place_of(*map, before);
    if (!T_body_cam) return T_body_cam.error();
    auto camera = read_camera(*map, name, *T_body_cam);
    if (!camera) return camera.error();
    before = camera->T_body_cam;
    reading.cameras.push_back(*std::move(camera));
    const auto topic = map->text("rostopic");
    reading.topics.push_back(topic ? *topic : "");
  }
  if (reading.cameras.empty()) return yaml->error("cam0", "nothing", "the first camera of the chain");
  constexpr std::size_t kLargestGap = 100;
  for (std::size_t i = 1; i <= kLargestGap; ++i) {
    const std::string later = fmt::format("cam{}", reading.cameras.size() + i);
    if (yaml->has(later)) {
      return yaml->error(fmt::format("cam{}", reading.cameras.size()), "nothing",
                         "a camera, since the chain has " + later);
    }
  }
  if (!imu) reading.notes.push_back("no T_cam_imu: the body frame is camera 0");
  return reading;
}

Result<std::string> kalibr_rig_text(const camera::Rig& rig, const std::string& out,
                                    const std::vector<std::string>& topics) {
  const RigLimits limits{.format = "Kalibr's camchain",
                         .models = {camera::Pinhole::kName, camera::PinholeRadTan::kName, camera::KannalaBrandt::kName,
                                    camera::Unified::kName, camera::ExtendedUnified::kName, camera::DoubleSphere::kName,
                                    camera::Fov::kName},
                         .time_offsets = Supports::kEach,
                         .max_coefficients = 4};
  if (const Status status = check_limits(rig, out, limits); !status) return status.error();
  std::string text;
  for (std::size_t i = 0; i < rig.size(); ++i) {
    const camera::CameraModel& model = rig.camera(i).model;
    if (std::holds_alternative<camera::Unified>(model) && camera::distortion(model)[0] == 1) {
      return Error{out, rig.camera(i).name, "alpha 1, for which xi is infinite", "alpha < 1"};
    }
    text += fmt::format("cam{}:\n", i) + transform_text("T_cam_imu", rig.body_from_cam(i).inverse());
    if (i > 0) text += transform_text("T_cn_cnm1", rig.body_from_cam(i).inverse() * rig.body_from_cam(i - 1));
    text += camera_text(rig, i, numbers_of(model), topics);
  }
  return text;
}

Result<std::string> openvins_rig_text(const camera::Rig& rig, const std::string& out,
                                      const std::vector<std::string>& topics) {
  const RigLimits limits{.format = "OpenVINS's camera chain",
                         .models = {camera::Pinhole::kName, camera::PinholeRadTan::kName, camera::KannalaBrandt::kName},
                         .time_offsets = Supports::kEach,
                         .max_coefficients = 4};
  if (const Status status = check_limits(rig, out, limits); !status) return status.error();
  std::string text = "%YAML:1.0\n\n";
  for (std::size_t i = 0; i < rig.size(); ++i) {
    KalibrNumbers numbers = numbers_of(rig.camera(i).model);
    if (numbers.distortion_model == "none") {  // OpenVINS does not support "none", so zero coefficients are written
      numbers.distortion_model = "radtan";
      numbers.coefficients.assign(4, 0.0);
    }
    text += fmt::format("cam{}:\n", i) + transform_text("T_imu_cam", rig.body_from_cam(i)) +
            camera_text(rig, i, numbers, topics);
  }
  return text;
}

}  // namespace bslam::rig_formats
