#include "rig_formats/okvis_rig.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include "base/number_text.h"
#include "rig_formats/rig_limits.h"
#include "yaml/yaml_map.h"

namespace bslam::rig_formats {
namespace {

namespace fs = std::filesystem;

// A distortion_type, the model of bslam, and the number of coefficients. A model is written as the first type that has
// enough of them.
struct OkvisDistortion {
  std::string_view name, model;
  std::size_t count;
  std::string_view order;
};
constexpr std::array<OkvisDistortion, 5> kDistortions = {
    {{"radialtangential", camera::PinholeRadTan::kName, 4, "k1 k2 p1 p2"},
     {"radialtangential8", camera::PinholeRadTan::kName, 8, "k1 k2 p1 p2 k3 k4 k5 k6"},
     {"equidistant", camera::KannalaBrandt::kName, 4, "k1 k2 k3 k4"},
     {"plumb_bob", camera::PinholeRadTan::kName, 4, "k1 k2 p1 p2"},
     {"plumb_bob8", camera::PinholeRadTan::kName, 8, "k1 k2 p1 p2 k3 k4 k5 k6"}}};

// Files may end the list of coefficients with zeros that OKVIS2 does not read.
Status read_distortion(const yaml::YamlMap& yaml, camera::CameraDescription& d) {
  const auto type = yaml.text("distortion_type");
  if (!type) return type.error();
  const auto* distortion = std::ranges::find(kDistortions, *type, &OkvisDistortion::name);
  if (distortion == kDistortions.end()) {
    std::vector<std::string_view> names;
    for (const OkvisDistortion& known : kDistortions) names.push_back(known.name);
    return yaml.error("distortion_type", *type, fmt::format("one of: {}", fmt::join(names, ", ")));
  }
  auto coefficients = yaml.numbers("distortion_coefficients");
  if (!coefficients) return coefficients.error();
  const std::size_t count = coefficients->size();
  while (coefficients->size() > distortion->count && coefficients->back() == 0) coefficients->pop_back();
  if (coefficients->size() != distortion->count) {
    return yaml.error("distortion_coefficients", fmt::format("{} numbers", count),
                      fmt::format("{} for {}: {}", distortion->count, distortion->name, distortion->order));
  }
  d.model = distortion->model;
  d.distortion = *std::move(coefficients);
  return {};
}

Status read_intrinsics(const yaml::YamlMap& yaml, camera::CameraDescription& d) {
  for (const auto& [key, expected] :
       {std::pair("focal_length", "two numbers: fx fy"), std::pair("principal_point", "two numbers: cx cy")}) {
    const auto numbers = yaml.numbers(key);
    if (!numbers) return numbers.error();
    if (numbers->size() != 2) return yaml.error(key, fmt::format("{} numbers", numbers->size()), expected);
    d.intrinsics.insert(d.intrinsics.end(), numbers->begin(), numbers->end());
  }
  return {};
}

Result<camera::RigCamera> read_camera(const yaml::YamlMap& yaml, camera::CameraDescription d,
                                      const std::string& delay_key) {
  if (const Status status = read_distortion(yaml, d); !status) return status.error();
  if (const Status status = read_intrinsics(yaml, d); !status) return status.error();
  const auto sides = yaml.numbers("image_dimension");
  if (!sides) return sides.error();
  auto resolution = camera::whole_pixels(*sides, yaml.file(), yaml.key_path("image_dimension"));
  if (!resolution) return resolution.error();
  d.resolution = *std::move(resolution);
  auto T_SC = yaml.numbers("T_SC");
  if (!T_SC) return T_SC.error();
  d.T_body_cam = *std::move(T_SC);
  return camera::make_camera(
      d, {yaml.file(), yaml.key_path("distortion_type"), yaml.key_path("image_dimension"),
          yaml.key_path("focal_length"), yaml.key_path("distortion_coefficients"), yaml.key_path("T_SC"), delay_key});
}

struct Delay {
  double seconds = 0;
  std::string key = "camera_parameters.image_delay";
};

Result<Delay> read_delay(const yaml::YamlMap& yaml) {
  const auto read = [](const yaml::YamlMap& map, const char* key) -> Result<Delay> {
    if (!map.has(key)) return Delay{};
    const auto seconds = map.number(key);
    if (!seconds) return seconds.error();
    return Delay{*seconds, map.key_path(key)};
  };
  if (!yaml.has("camera_parameters")) return read(yaml, "imageDelay");
  const auto parameters = yaml.map("camera_parameters");
  if (!parameters) return parameters.error();
  return read(*parameters, "image_delay");
}

std::string camera_text(const camera::Camera& camera, const geometry::SE3& T_body_cam) {
  const camera::Intrinsics& k = camera::intrinsics(camera.model);
  std::vector<double> d = needed_coefficients(camera.model);
  const std::string_view model = d.empty() ? camera::PinholeRadTan::kName : camera::model_name(camera.model);
  const auto* distortion = std::ranges::find_if(
      kDistortions, [&](const OkvisDistortion& known) { return known.model == model && known.count >= d.size(); });
  d.resize(distortion->count, 0.0);
  return fmt::format(
      "  - T_SC: {}\n    image_dimension: [{}, {}]\n    distortion_coefficients: {}\n    distortion_type: {}\n"
      "    focal_length: {}\n    principal_point: {}\n    camera_type: gray\n    slam_use: okvis\n",
      number_list(camera::rows_of(T_body_cam)), camera.width, camera.height, number_list(d), distortion->name,
      number_list({k.fx, k.fy}), number_list({k.cx, k.cy}));
}

}  // namespace

Result<camera::RigReading> read_okvis_rig(const fs::path& file, const std::string& text) {
  const auto yaml = yaml::YamlMap::parse(file, text);
  if (!yaml) return yaml.error();
  const auto maps = yaml->maps("cameras");
  if (!maps) return maps.error();
  const auto delay = read_delay(*yaml);
  if (!delay) return delay.error();
  camera::RigReading reading;
  for (const yaml::YamlMap& map : *maps) {
    camera::CameraDescription d;
    d.name = fmt::format("cam{}", reading.cameras.size());
    d.time_offset_s = 0.0 - delay->seconds;  // not -0
    auto camera = read_camera(map, d, delay->key);
    if (!camera) return camera.error();
    if (map.has("slam_use") && map.text("slam_use").ok() && *map.text("slam_use") == "none") {
      reading.notes.push_back(fmt::format("{} is read although OKVIS2 does not use it (slam_use: none)", d.name));
    }
    reading.cameras.push_back(*std::move(camera));
  }
  return reading;
}

Result<std::string> okvis_rig_text(const camera::Rig& rig, const std::string& out) {
  const RigLimits limits{.format = "OKVIS2's configuration",
                         .models = {camera::Pinhole::kName, camera::PinholeRadTan::kName, camera::KannalaBrandt::kName},
                         .time_offsets = Supports::kOneForAll};
  if (const Status status = check_limits(rig, out, limits); !status) return status.error();
  std::string text = "%YAML:1.0\ncameras:\n";
  std::vector<std::size_t> numbers;
  for (std::size_t i = 0; i < rig.size(); ++i) {
    text += camera_text(rig.camera(i), rig.body_from_cam(i));
    numbers.push_back(i);
  }
  const double offset_s = static_cast<double>(rig.camera(std::size_t{0}).time_offset_ns) / 1e9;
  return text + fmt::format(
                    "\ncamera_parameters:\n  timestamp_tolerance: 0.005\n  sync_cameras: [{}]\n  image_delay: {}\n\n"
                    "# To be completed for OKVIS2: camera_parameters.online_calibration, imu_parameters,\n"
                    "# frontend_parameters, estimator_parameters and output_parameters.\n",
                    fmt::join(numbers, ", "), format_double(0.0 - offset_s));
}

}  // namespace bslam::rig_formats
