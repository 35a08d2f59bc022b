#include "rig_formats/euroc_sensor.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <optional>
#include <system_error>
#include <utility>

#include "base/atomic_file.h"
#include "base/number_text.h"
#include "camera/camera_description.h"
#include "rig_formats/rig_limits.h"
#include "yaml/yaml_map.h"

namespace bslam::rig_formats {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxSensorBytes = std::size_t{1} << 20;
constexpr std::array kModels = {camera::Pinhole::kName, camera::PinholeRadTan::kName, camera::KannalaBrandt::kName};

// Converts names of distortion models between EuRoC and bslam.
std::optional<std::string> model_name(const std::string& distortion_model) {
  if (distortion_model == "none") return std::string(camera::Pinhole::kName);
  if (distortion_model == "radial-tangential" || distortion_model == "radtan") {
    return std::string(camera::PinholeRadTan::kName);
  }
  if (distortion_model == "equidistant") return std::string(camera::KannalaBrandt::kName);
  return std::nullopt;
}

std::string distortion_name(const camera::CameraModel& model) {
  const std::string_view name = camera::model_name(model);
  if (name == camera::Pinhole::kName) return "none";
  return name == camera::PinholeRadTan::kName ? "radial-tangential" : "equidistant";
}

Status read_model(const yaml::YamlMap& yaml, camera::CameraDescription& out) {
  const auto camera_model = yaml.text("camera_model");
  if (!camera_model) return camera_model.error();
  if (*camera_model != "pinhole") return yaml.error("camera_model", *camera_model, "pinhole");
  const auto distortion_model = yaml.text("distortion_model");
  if (!distortion_model) return distortion_model.error();
  const auto model = model_name(*distortion_model);
  if (!model) {
    return yaml.error("distortion_model", *distortion_model, "one of: none, radial-tangential, equidistant");
  }
  out.model = *model;
  if (*distortion_model == "none" && !yaml.has("distortion_coefficients")) return {};
  auto distortion = yaml.numbers("distortion_coefficients");
  if (!distortion) return distortion.error();
  // Files without distortion often contain coefficients that are 0.
  const bool zero = std::all_of(distortion->begin(), distortion->end(), [](double v) { return v == 0; });
  if (!(*distortion_model == "none" && zero)) out.distortion = *std::move(distortion);
  return {};
}

std::string row_text(const Eigen::Matrix4d& T, int row) {
  return fmt::format("{}, {}, {}, {}", format_double(T(row, 0)), format_double(T(row, 1)), format_double(T(row, 2)),
                     format_double(T(row, 3)));
}

}  // namespace

Result<camera::RigCamera> read_euroc_sensor(const fs::path& file, const std::string& name) {
  auto text = read_file(file, kMaxSensorBytes);
  if (!text) return text.error();
  const auto yaml = yaml::YamlMap::parse(file, *std::move(text));
  if (!yaml) return yaml.error();
  camera::CameraDescription d;
  d.name = name;
  if (const Status status = read_model(*yaml, d); !status) return status.error();
  const auto sides = yaml->numbers("resolution");
  if (!sides) return sides.error();
  auto resolution = camera::whole_pixels(*sides, yaml->file(), yaml->key_path("resolution"));
  if (!resolution) return resolution.error();
  d.resolution = *std::move(resolution);
  auto intrinsics = yaml->numbers("intrinsics");
  if (!intrinsics) return intrinsics.error();
  d.intrinsics = *std::move(intrinsics);
  const auto T_BS = yaml->map("T_BS");
  if (!T_BS) return T_BS.error();
  auto data = T_BS->numbers("data");
  if (!data) return data.error();
  d.T_body_cam = *std::move(data);
  if (yaml->has("rolling_shutter_readout_s")) {
    const auto readout = yaml->number("rolling_shutter_readout_s");
    if (!readout) return readout.error();
    d.readout_s = *readout;
  }
  return camera::make_camera(d, {.file = file.string(),
                                 .model = "distortion_model",
                                 .resolution = "resolution",
                                 .intrinsics = "intrinsics",
                                 .distortion = "distortion_coefficients",
                                 .T_body_cam = "T_BS.data",
                                 .time_offset = "",
                                 .readout = "rolling_shutter_readout_s"});
}

std::vector<fs::path> camera_folders(const fs::path& folder, const std::string& entry) {
  std::vector<std::pair<std::int64_t, fs::path>> found;
  std::error_code error;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    const std::string name = it->path().filename().string();
    if (!name.starts_with("cam") || name.find_first_not_of("0123456789", 3) != std::string::npos) continue;
    const auto number = parse_integer(std::string_view(name).substr(3));
    std::error_code no_entry;
    if (number && fs::exists(it->path() / entry, no_entry)) found.emplace_back(*number, it->path());
  }
  std::sort(found.begin(), found.end());
  std::vector<fs::path> folders;
  for (auto& [number, path] : found) folders.push_back(std::move(path));
  return folders;
}

fs::path euroc_root(const fs::path& data) {
  std::error_code error;
  return fs::is_directory(data / "mav0", error) ? data / "mav0" : data;
}

bool euroc_holds_models(const camera::Rig& rig) {
  for (std::size_t c = 0; c < rig.size(); ++c) {
    if (std::ranges::find(kModels, camera::model_name(rig.camera(c).model)) == kModels.end()) return false;
  }
  return true;
}

std::string euroc_sensor_yaml(const camera::RigCamera& rig_camera, double rate_hz) {
  const camera::Camera& camera = rig_camera.camera;
  const camera::Intrinsics& k = camera::intrinsics(camera.model);
  const Eigen::Matrix4d T = rig_camera.T_body_cam.matrix();
  std::vector<std::string> distortion;
  for (const double value : camera::distortion(camera.model)) distortion.push_back(format_double(value));
  std::string text = fmt::format(
      "sensor_type: camera\n"
      "comment: {}\n"
      "T_BS:\n"
      "  cols: 4\n"
      "  rows: 4\n"
      "  data: [{},\n"
      "         {},\n"
      "         {},\n"
      "         {}]\n"
      "rate_hz: {}\n"
      "resolution: [{}, {}]\n"
      "camera_model: pinhole\n"
      "intrinsics: [{}, {}, {}, {}]  # fu, fv, cu, cv\n"
      "distortion_model: {}\n"
      "distortion_coefficients: [{}]\n",
      yaml::yaml_quoted(camera.name), row_text(T, 0), row_text(T, 1), row_text(T, 2), row_text(T, 3),
      format_double(rate_hz), camera.width, camera.height, format_double(k.fx), format_double(k.fy),
      format_double(k.cx), format_double(k.cy), distortion_name(camera.model), fmt::join(distortion, ", "));
  if (camera.readout_s != 0) text += fmt::format("rolling_shutter_readout_s: {}\n", format_double(camera.readout_s));
  return text;
}

Status write_euroc_sensors(const camera::Rig& rig, const fs::path& folder, double rate_hz) {
  const RigLimits limits{
      .format = "EuRoC sensor files", .models = {kModels.begin(), kModels.end()}, .rolling_shutters = true};
  if (const Status status = check_limits(rig, folder.string(), limits); !status) return status;
  for (std::size_t i = 0; i < rig.size(); ++i) {
    const fs::path camera_folder = folder / "mav0" / fmt::format("cam{}", i);
    std::error_code error;
    fs::create_directories(camera_folder, error);
    if (error) return Error{camera_folder.string(), "", error.message(), "a folder that can be created"};
    const Status status = write_atomically(camera_folder / "sensor.yaml",
                                           euroc_sensor_yaml({rig.camera(i), rig.body_from_cam(i)}, rate_hz));
    if (!status) return status;
  }
  return {};
}

}  // namespace bslam::rig_formats
