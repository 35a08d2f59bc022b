#include "rig_formats/colmap_rig.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <optional>
#include <sstream>

#include "base/atomic_file.h"
#include "base/number_text.h"
#include "rig_formats/rig_limits.h"
#include "yaml/yaml_map.h"

namespace bslam::rig_formats {
namespace {

namespace fs = std::filesystem;
using geometry::SE3;

constexpr std::size_t kMaxBytes = std::size_t{1} << 24;
constexpr const char* kInOrder =
    "the cameras of rig_config.json correspond to the cameras of cameras.txt in order of their ids";
constexpr double kPixelShift =
    0.5;  // the origin is the corner of the top-left pixel in COLMAP, and its centre in bslam

// A model of COLMAP: the corresponding model of bslam, its number of focal lengths, the number of coefficients after cx
// cy, and the number of coefficients in bslam.
struct ColmapModel {
  std::string_view name, model;
  std::size_t focal_lengths, coefficients, ours;
};
constexpr std::array<ColmapModel, 9> kModels = {{{"SIMPLE_PINHOLE", camera::Pinhole::kName, 1, 0, 0},
                                                 {"PINHOLE", camera::Pinhole::kName, 2, 0, 0},
                                                 {"SIMPLE_RADIAL", camera::PinholeRadTan::kName, 1, 1, 4},
                                                 {"RADIAL", camera::PinholeRadTan::kName, 1, 2, 4},
                                                 {"OPENCV", camera::PinholeRadTan::kName, 2, 4, 4},
                                                 {"FULL_OPENCV", camera::PinholeRadTan::kName, 2, 8, 8},
                                                 {"OPENCV_FISHEYE", camera::KannalaBrandt::kName, 2, 4, 4},
                                                 {"FOV", camera::Fov::kName, 2, 1, 1},
                                                 {"EUCM", camera::ExtendedUnified::kName, 2, 2, 2}}};

// File and line of a text, for errors.
struct Place {
  std::string file, key;
  Error error(std::string found, std::string expected) const {
    return {file, key, std::move(found), std::move(expected)};
  }
};

Status read_parameters(const std::string& name, const std::vector<double>& p, const Place& at,
                       camera::CameraDescription& d) {
  const auto* model =
      std::find_if(kModels.begin(), kModels.end(), [&](const ColmapModel& m) { return m.name == name; });
  if (model == kModels.end()) {
    std::vector<std::string_view> names;
    for (const ColmapModel& m : kModels) names.push_back(m.name);
    return at.error(name, fmt::format("one of: {}", fmt::join(names, ", ")));
  }
  const std::size_t n = model->focal_lengths;
  if (p.size() != n + 2 + model->coefficients) {
    return at.error(fmt::format("{} parameters", p.size()),
                    fmt::format("{} for {}", n + 2 + model->coefficients, name));
  }
  d.model = model->model;
  d.intrinsics = {p[0], p[n - 1], p[n] - kPixelShift, p[n + 1] - kPixelShift};
  d.distortion.assign(p.begin() + static_cast<std::ptrdiff_t>(n) + 2, p.end());
  d.distortion.resize(model->ours, 0.0);
  return {};
}

// Returns the words of every line that is neither empty nor a comment, by line number.
std::map<std::size_t, std::vector<std::string>> lines_of(const std::string& text) {
  std::map<std::size_t, std::vector<std::string>> lines;
  std::istringstream stream(text);
  std::size_t number = 0;
  for (std::string line; std::getline(stream, line);) {
    ++number;
    std::istringstream words(line);
    for (std::string word; words >> word;) {
      if (word.front() == '#') break;
      lines[number].push_back(word);
    }
  }
  return lines;
}

Result<std::vector<double>> numbers_of(const std::vector<std::string>& words, std::size_t from, std::size_t count,
                                       const Place& at) {
  if (words.size() < from + count)
    return at.error(fmt::format("{} words", words.size()), fmt::format("at least {} words", from + count));
  std::vector<double> numbers;
  for (std::size_t i = from; i < from + count; ++i) {
    const auto value = parse_double(words[i]);
    if (!value) return at.error(words[i], "a finite number");
    numbers.push_back(*value);
  }
  return numbers;
}

using Cameras = std::map<std::int64_t, camera::CameraDescription>;  // by COLMAP's id

Result<Cameras> read_cameras(const fs::path& file) {
  const auto text = read_text(file, kMaxBytes);
  if (!text) return text.error();
  Cameras cameras;
  for (const auto& [number, words] : lines_of(*text)) {
    const Place at{file.string(), fmt::format("line {}", number)};
    if (words.size() < 4)
      return at.error(fmt::format("{} words", words.size()), "CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]");
    const auto id = parse_integer(words[0]), width = parse_integer(words[2]), height = parse_integer(words[3]);
    if (!id || !width || !height) return at.error(words[0] + " " + words[1], "CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]");
    const auto parameters = numbers_of(words, 4, words.size() - 4, at);
    if (!parameters) return parameters.error();
    camera::CameraDescription d;
    d.name = fmt::format("camera_{}", *id);
    d.resolution = {*width, *height};
    if (const Status status = read_parameters(words[1], *parameters, at, d); !status) return status.error();
    if (!cameras.emplace(*id, d).second) return at.error(fmt::format("camera {} twice", *id), "each camera once");
  }
  if (cameras.empty()) return Error{file.string(), "", "no camera", "a line for every camera"};
  return cameras;
}

// The order of q is w x y z. The pose of a sensor is camera from rig.
Result<SE3> rig_from_camera(const std::vector<double>& q, const std::vector<double>& t, const Place& at) {
  const auto T_cam_rig =
      camera::rigid_transform(geometry::Quaterniond(q[0], q[1], q[2], q[3]), {t[0], t[1], t[2]}, at.file, at.key);
  if (!T_cam_rig) return T_cam_rig.error();
  return T_cam_rig->inverse();
}

Status add(camera::CameraDescription d, const SE3& T_rig_cam, const Place& at, camera::RigReading& reading) {
  d.T_body_cam = camera::rows_of(T_rig_cam);
  auto camera = camera::make_camera(d, {at.file, at.key, at.key, at.key, at.key, at.key, at.key});
  if (!camera) return camera.error();
  reading.cameras.push_back(*std::move(camera));
  return {};
}

Error unknown_camera(const Place& at, const std::string& id) {
  return at.error("camera " + id, "a camera of cameras.txt");
}

Result<camera::RigReading> read_rigs_txt(const fs::path& file, const Cameras& cameras) {
  const auto text = read_text(file, kMaxBytes);
  if (!text) return text.error();
  const auto lines = lines_of(*text);
  if (lines.size() != 1) return Error{file.string(), "", fmt::format("{} rigs", lines.size()), "one rig"};
  const auto& [number, words] = *lines.begin();
  const Place at{file.string(), fmt::format("line {}", number)};
  constexpr const char* kExpected = "RIG_ID NUM_SENSORS CAMERA REF_ID (CAMERA ID 1 QW QX QY QZ TX TY TZ)...";
  camera::RigReading reading;
  for (std::size_t i = 2; i < words.size();) {
    const std::int64_t id = i + 1 < words.size() ? parse_integer(words[i + 1]).value_or(-1) : -1;
    if (words[i] != "CAMERA" || id < 0) return at.error(words[i], kExpected);
    const auto camera = cameras.find(id);
    if (camera == cameras.end()) return unknown_camera(at, words[i + 1]);
    SE3 T_rig_cam;
    i += 2;
    if (!reading.cameras.empty()) {
      const auto numbers = numbers_of(words, i, 8, at);  // the flag and the pose
      if (!numbers) return numbers.error();
      const auto& n = *numbers;
      if (n[0] != 1) return at.error(fmt::format("camera {} without a pose", id), "HAS_POSE 1");
      const auto T = rig_from_camera({n[1], n[2], n[3], n[4]}, {n[5], n[6], n[7]}, at);
      if (!T) return T.error();
      T_rig_cam = *T;
      i += 8;
    }
    if (const Status status = add(camera->second, T_rig_cam, at, reading); !status) return status.error();
  }
  if (reading.cameras.empty()) return at.error("no sensor", kExpected);
  return reading;
}

// Returns the cameras of rig_config.json in the order of the file. Their number must equal the number of cameras in
// cameras.txt.
Result<std::vector<yaml::YamlMap>> configured_cameras(const fs::path& file, std::size_t count) {
  const auto text = read_text(file, kMaxBytes);
  if (!text) return text.error();
  std::string wrapped = "{\"rigs\": " + *text + "\n}";  // the root is a list, and JSON is valid YAML except for tabs
  std::replace(wrapped.begin(), wrapped.end(), '\t', ' ');
  const auto yaml = yaml::YamlMap::parse(file, std::move(wrapped));
  if (!yaml) return yaml.error();
  const auto rigs = yaml->maps("rigs");
  if (!rigs) return rigs.error();
  if (rigs->size() != 1) return Error{file.string(), "", fmt::format("{} rigs", rigs->size()), "one rig"};
  auto configured = rigs->front().maps("cameras");
  if (configured && configured->size() != count) {
    return rigs->front().error("cameras", fmt::format("{} cameras", configured->size()),
                               fmt::format("{}, as in cameras.txt", count));
  }
  return configured;
}

// Names the cameras, in the order of their ids, after the folders of their images.
Status take_names(const std::vector<yaml::YamlMap>& configured, Cameras& cameras) {
  auto camera = cameras.begin();
  for (const yaml::YamlMap& yaml : configured) {
    camera::CameraDescription& d = (camera++)->second;
    if (!yaml.has("image_prefix")) continue;
    const auto prefix = yaml.text("image_prefix");
    if (!prefix) return prefix.error();
    d.name = *prefix;
    while (d.name.ends_with('/')) d.name.pop_back();
  }
  return {};
}

// Adds one camera of rig_config.json, whose values take precedence over the values in cameras.txt.
Status read_configured(const yaml::YamlMap& yaml, camera::CameraDescription d, camera::RigReading& reading) {
  const Place at{yaml.file(), yaml.key_path("camera_params")};
  if (yaml.has("camera_params")) {
    const auto name = yaml.text("camera_model_name");
    const auto parameters = yaml.numbers("camera_params");
    if (!name) return name.error();
    if (!parameters) return parameters.error();
    if (const Status status = read_parameters(*name, *parameters, at, d); !status) return status;
  }
  if (yaml.has("ref_sensor")) return add(d, SE3(), at, reading);
  const auto q = yaml.numbers("cam_from_rig_rotation"), t = yaml.numbers("cam_from_rig_translation");
  if (!q) return q.error();
  if (!t) return t.error();
  if (q->size() != 4)
    return yaml.error("cam_from_rig_rotation", fmt::format("{} numbers", q->size()), "four (w x y z)");
  if (t->size() != 3) return yaml.error("cam_from_rig_translation", fmt::format("{} numbers", t->size()), "three");
  const auto T = rig_from_camera(*q, *t, {yaml.file(), yaml.key_path("cam_from_rig_rotation")});
  if (!T) return T.error();
  return add(d, *T, at, reading);
}

Result<camera::RigReading> read_rig_config(const std::vector<yaml::YamlMap>& configured, const Cameras& cameras) {
  camera::RigReading reading;
  auto camera = cameras.begin();
  for (const yaml::YamlMap& map : configured) {
    if (const Status status = read_configured(map, (camera++)->second, reading); !status) return status.error();
  }
  reading.notes.emplace_back(kInOrder);
  return reading;
}

// Reads poses from rigs.txt, and names from rig_config.json if that file can be read.
Result<camera::RigReading> read_solved(const fs::path& rigs, const fs::path& config, Cameras& cameras) {
  std::string note;
  std::error_code error;
  if (fs::exists(config, error)) {
    const auto configured = configured_cameras(config, cameras.size());
    const Status named = configured ? take_names(*configured, cameras) : Status(configured.error());
    if (!named) note = "camera names are taken from cameras.txt: " + named.error().message();
  }
  auto reading = read_rigs_txt(rigs, cameras);
  if (reading && !note.empty()) reading->notes.push_back(note);
  return reading;
}

// The parameters in the first model of the table that holds all of them.
std::string camera_parameters(const camera::CameraModel& model, std::string_view separator, std::string& name) {
  const camera::Intrinsics& k = camera::intrinsics(model);
  std::vector<double> d = needed_coefficients(model);
  const auto* written = std::ranges::find_if(kModels, [&](const ColmapModel& m) {
    return m.model == camera::model_name(model) && m.focal_lengths == 2 && m.coefficients >= d.size();
  });
  d.resize(written->coefficients, 0.0);
  name = written->name;
  d.insert(d.begin(), {k.fx, k.fy, k.cx + kPixelShift, k.cy + kPixelShift});
  std::vector<std::string> texts;
  for (const double value : d) texts.push_back(format_double(value));
  return fmt::format("{}", fmt::join(texts, separator));
}

// Returns the text as a JSON string.
std::string json_quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out +=
        static_cast<unsigned char>(c) < 0x20 ? fmt::format("\\u{:04x}", static_cast<unsigned>(c)) : std::string(1, c);
  }
  return out + '"';
}

}  // namespace

Result<camera::RigReading> read_colmap_rig(const fs::path& folder) {
  auto cameras = read_cameras(folder / "cameras.txt");
  if (!cameras) return cameras.error();
  std::error_code error;
  const fs::path rigs = folder / "rigs.txt", config = folder / "rig_config.json";
  if (fs::exists(rigs, error)) return read_solved(rigs, config, *cameras);
  if (fs::exists(config, error)) {
    const auto configured = configured_cameras(config, cameras->size());
    if (!configured) return configured.error();
    if (const Status status = take_names(*configured, *cameras); !status) return status.error();
    return read_rig_config(*configured, *cameras);
  }
  if (cameras->size() > 1) {
    return Error{folder.string(), "", fmt::format("{} cameras without extrinsics", cameras->size()),
                 "rigs.txt or rig_config.json in the folder of cameras.txt"};
  }
  camera::RigReading reading;
  const Status status = add(cameras->begin()->second, SE3(), {(folder / "cameras.txt").string(), ""}, reading);
  if (!status) return status.error();
  return reading;
}

Result<std::vector<NamedText>> colmap_rig_texts(const camera::Rig& rig, const std::string& out) {
  const RigLimits limits{.format = "a COLMAP rig",
                         .models = {camera::Pinhole::kName, camera::PinholeRadTan::kName, camera::KannalaBrandt::kName,
                                    camera::Fov::kName},
                         .body_frame = false};
  if (const Status status = check_limits(rig, out, limits); !status) return status.error();
  std::string cameras = "# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n";
  std::string rigs =
      "# RIG_ID, NUM_SENSORS, REF_SENSOR_TYPE, REF_SENSOR_ID, SENSORS[] as (SENSOR_TYPE, SENSOR_ID, "
      "HAS_POSE, [QW, QX, QY, QZ, TX, TY, TZ])\n";
  rigs += fmt::format("1 {} CAMERA 1", rig.size());
  std::string config = "[\n  {\n    \"cameras\": [\n";
  for (std::size_t i = 0; i < rig.size(); ++i) {
    const camera::Camera& camera = rig.camera(i);
    std::string model;
    const std::string words = camera_parameters(camera.model, " ", model);
    cameras += fmt::format("{} {} {} {} {}\n", i + 1, model, camera.width, camera.height, words);
    config += fmt::format("      {{\"image_prefix\": {}, \"camera_model_name\": \"{}\", \"camera_params\": [{}], ",
                          json_quoted(camera.name + "/"), model, camera_parameters(camera.model, ", ", model));
    if (i == 0) {
      config += "\"ref_sensor\": true}";
    } else {
      const SE3& T = rig.cam_from_rig(i);
      const geometry::Quaterniond& q = T.rotation();
      const auto pose = [&](std::string_view separator, std::size_t from, std::size_t to) {
        const std::array<double, 7> all = {
            q.w(), q.x(), q.y(), q.z(), T.translation().x(), T.translation().y(), T.translation().z()};
        std::vector<std::string> texts;
        for (std::size_t k = from; k < to; ++k) texts.push_back(format_double(all[k]));
        return fmt::format("{}", fmt::join(texts, separator));
      };
      rigs += fmt::format(" CAMERA {} 1 {}", i + 1, pose(" ", 0, 7));
      config += fmt::format("\"cam_from_rig_rotation\": [{}], \"cam_from_rig_translation\": [{}]}}", pose(", ", 0, 4),
                            pose(", ", 4, 7));
    }
    config += i + 1 < rig.size() ? ",\n" : "\n";
  }
  return std::vector<NamedText>{
      {"cameras.txt", cameras}, {"rigs.txt", rigs + "\n"}, {"rig_config.json", config + "    ]\n  }\n]\n"}};
}

}  // namespace bslam::rig_formats
