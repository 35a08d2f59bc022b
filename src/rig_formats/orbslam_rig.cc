#include "rig_formats/orbslam_rig.h"

#include <fmt/format.h>

#include <optional>
#include <utility>
#include <vector>

#include "base/number_text.h"
#include "rig_formats/rig_limits.h"
#include "yaml/yaml_map.h"

namespace bslam::rig_formats {
namespace {

namespace fs = std::filesystem;
using geometry::Matrix3d;
using geometry::SE3;

// The files contain "data:[1, 2]" without a space, which OpenCV accepts although it is not valid YAML.
std::string with_spaces(std::string text) {
  constexpr std::string_view kTight = "data:[";
  for (std::size_t at = text.find(kTight); at != std::string::npos; at = text.find(kTight, at + kTight.size())) {
    text.insert(at + kTight.size() - 1, 1, ' ');
  }
  return text;
}

// Reads a !!opencv-matrix of `count` numbers, row-major.
Result<std::vector<double>> matrix(const yaml::YamlMap& yaml, const char* key, std::size_t count) {
  const auto map = yaml.map(key);
  if (!map) return map.error();
  auto data = map->numbers("data");
  if (!data) return data.error();
  if (data->size() != count) {
    return map->error("data", fmt::format("{} numbers", data->size()), fmt::format("{}", count));
  }
  return data;
}

// Reads a rigid transform of three or four rows.
Result<SE3> transform(const yaml::YamlMap& yaml, const char* key) {
  const auto map = yaml.map(key);
  if (!map) return map.error();
  auto data = map->numbers("data");
  if (!data) return data.error();
  if (data->size() == 12) data->insert(data->end(), {0, 0, 0, 1});
  return camera::rigid_transform(*data, yaml.file(), std::string(key) + ".data");
}

Result<std::vector<double>> prefixed(const yaml::YamlMap& yaml, const std::string& prefix,
                                     const std::vector<std::string>& names) {
  std::vector<double> numbers;
  for (const std::string& name : names) {
    const auto number = yaml.number(prefix + name);
    if (!number) return number.error();
    numbers.push_back(*number);
  }
  return numbers;
}

// Reads model, intrinsics and coefficients under a prefix such as "Camera1.".
Status read_model(const yaml::YamlMap& yaml, const std::string& type, const std::string& prefix,
                  camera::CameraDescription& d) {
  auto intrinsics = prefixed(yaml, prefix, {"fx", "fy", "cx", "cy"});
  if (!intrinsics) return intrinsics.error();
  d.intrinsics = *std::move(intrinsics);
  std::vector<std::string> names;
  if (type == "KannalaBrandt8") {
    d.model = camera::KannalaBrandt::kName;
    names = {"k1", "k2", "k3", "k4"};
  } else if (type == "PinHole") {
    // Either both cameras of a file have coefficients or none.
    const bool distorted = yaml.has(prefix + "k1") || yaml.has("Camera1.k1") || yaml.has("Camera2.k1");
    d.model = distorted ? camera::PinholeRadTan::kName : camera::Pinhole::kName;
    if (distorted) names = {"k1", "k2", "p1", "p2"};
    if (distorted && yaml.has(prefix + "k3")) names.push_back("k3");
  } else if (type == "Rectified") {
    d.model = camera::Pinhole::kName;
  } else {
    return yaml.error("Camera.type", type, "one of: PinHole, KannalaBrandt8, Rectified");
  }
  auto coefficients = prefixed(yaml, prefix, names);
  if (!coefficients) return coefficients.error();
  d.distortion = *std::move(coefficients);
  return {};
}

struct OrbslamFile {
  const yaml::YamlMap& yaml;
  std::string type = "PinHole";
  std::string prefix;                    // prefix of the keys of camera 1
  std::vector<std::int64_t> resolution;  // resolution of both cameras
  SE3 T_body_cam1;
  camera::RigReading reading = {};

  Status add(camera::CameraDescription d, const SE3& T_cam1_cam, const std::string& from) {
    d.name = fmt::format("cam{}", reading.cameras.size());
    d.resolution = resolution;
    d.T_body_cam = camera::rows_of(T_body_cam1 * T_cam1_cam);
    auto camera = camera::make_camera(
        d, {yaml.file(), "Camera.type", "Camera.width, Camera.height", from + "fx", from + "k1", "Stereo.T_c1_c2", ""});
    if (!camera) return camera.error();
    reading.cameras.push_back(*std::move(camera));
    return {};
  }
};

// Raw cameras with rectifying rotations, p_rectified = R p. In the rectified frame, camera RIGHT is shifted to the
// right by the baseline.
Status read_rectification(OrbslamFile& file, double baseline) {
  std::optional<SE3> T_rectified_left;
  for (const std::string side : {"LEFT", "RIGHT"}) {
    const auto K = matrix(file.yaml, (side + ".K").c_str(), 9), R = matrix(file.yaml, (side + ".R").c_str(), 9);
    if (!K) return K.error();
    if (!R) return R.error();
    const auto& r = *R;
    const auto T_rectified_raw =
        camera::rigid_transform({r[0], r[1], r[2], 0, r[3], r[4], r[5], 0, r[6], r[7], r[8], 0, 0, 0, 0, 1},
                                file.yaml.file(), side + ".R.data");
    if (!T_rectified_raw) return T_rectified_raw.error();
    const auto D = file.yaml.map(side + ".D");
    if (!D) return D.error();
    auto coefficients = D->numbers("data");
    if (!coefficients) return coefficients.error();
    camera::CameraDescription d;
    d.model = camera::PinholeRadTan::kName;
    d.intrinsics = {(*K)[0], (*K)[4], (*K)[2], (*K)[5]};
    d.distortion = *std::move(coefficients);
    SE3 T_left_raw;
    if (T_rectified_left) {
      const SE3 shifted(T_rectified_raw->rotation(), {baseline, 0, 0});
      T_left_raw = T_rectified_left->inverse() * shifted;
    } else {
      T_rectified_left = *T_rectified_raw;
    }
    if (const Status status = file.add(d, T_left_raw, side + "."); !status) return status;
  }
  file.reading.notes.push_back("read as the raw cameras LEFT and RIGHT, not as the rectified ones");
  return {};
}

// Returns the baseline of rectified cameras in metres, if the file contains it.
Result<std::optional<double>> baseline_of(const yaml::YamlMap& yaml, const std::string& prefix) {
  for (const char* key : {"Stereo.b", "Camera.bf"}) {
    if (!yaml.has(key)) continue;
    const auto value = yaml.number(key);
    if (!value) return value.error();
    if (!(*value > 0)) return yaml.error(key, fmt::format("{}", *value), "a positive number");
    if (std::string_view(key) == "Stereo.b") return std::optional(*value);
    const auto fx = yaml.number(prefix + "fx");
    if (!fx) return fx.error();
    return std::optional(*value / *fx);
  }
  return std::optional<double>();
}

Status read_cameras(OrbslamFile& file) {
  const yaml::YamlMap& yaml = file.yaml;
  const auto baseline = baseline_of(yaml, file.prefix);
  if (!baseline) return baseline.error();
  if (yaml.has("LEFT.K") && yaml.has("RIGHT.K")) {
    if (!*baseline) return yaml.error("Camera.bf", "nothing", "baseline x fx");
    return read_rectification(file, **baseline);
  }
  camera::CameraDescription first;
  if (const Status status = read_model(yaml, file.type, file.prefix, first); !status) return status;
  if (const Status status = file.add(first, SE3(), file.prefix); !status) return status;
  const bool second = yaml.has("Camera2.fx");
  const char* key = yaml.has("Tlr") ? "Tlr" : "Stereo.T_c1_c2";
  if (second || yaml.has(key)) {
    const auto T_c1_c2 = transform(yaml, key);
    if (!T_c1_c2) return T_c1_c2.error();
    camera::CameraDescription d;
    if (const Status status = read_model(yaml, file.type, "Camera2.", d); !status) return status;
    if (file.type == "KannalaBrandt8") {
      file.reading.notes.push_back(
          "camera 2 has its own k1 to k4; ORB-SLAM3 V1.0 uses k1 to k4 of camera 1 instead, so its results may differ");
    }
    return file.add(d, *T_c1_c2, "Camera2.");
  }
  if (!*baseline) return {};
  if (yaml.has("RGBD.DepthMapFactor") || yaml.has("DepthMapFactor")) {
    file.reading.notes.push_back("this is an RGB-D file, whose baseline is virtual: only one camera is read");
    return {};
  }
  return file.add(first, SE3(geometry::Quaterniond::Identity(), {**baseline, 0, 0}), file.prefix);
}

std::string model_text(const camera::CameraModel& model, int number) {
  const camera::Intrinsics& k = camera::intrinsics(model);
  std::string text = fmt::format("Camera{0}.fx: {1}\nCamera{0}.fy: {2}\nCamera{0}.cx: {3}\nCamera{0}.cy: {4}\n", number,
                                 format_double(k.fx), format_double(k.fy), format_double(k.cx), format_double(k.cy));
  const bool fisheye = std::holds_alternative<camera::KannalaBrandt>(model);
  const std::vector<const char*> names =
      fisheye ? std::vector{"k1", "k2", "k3", "k4"} : std::vector{"k1", "k2", "p1", "p2", "k3"};
  const std::vector<double> d = needed_coefficients(model);
  for (std::size_t i = 0; i < d.size(); ++i) {
    text += fmt::format("Camera{}.{}: {}\n", number, names[i], format_double(d[i]));
  }
  return text + "\n";
}

// The type dt is f (float), since ORB-SLAM3 reads the matrix as floats and OpenCV does not convert.
std::string matrix_text(const char* key, const SE3& T) {
  return fmt::format("{}: !!opencv-matrix\n  rows: 4\n  cols: 4\n  dt: f\n  data: {}\n\n", key,
                     number_list(camera::rows_of(T)));
}

}  // namespace

Result<camera::RigReading> read_orbslam_rig(const fs::path& file, const std::string& text) {
  const auto yaml = yaml::YamlMap::parse(file, with_spaces(text));
  if (!yaml) return yaml.error();
  OrbslamFile orbslam{
      .yaml = *yaml, .prefix = yaml->has("Camera1.fx") ? "Camera1." : "Camera.", .resolution = {}, .T_body_cam1 = {}};
  if (yaml->has("Camera.type")) {
    const auto type = yaml->text("Camera.type");
    if (!type) return type.error();
    orbslam.type = *type;
  }
  for (const char* key : {"Camera.width", "Camera.height"}) {
    const auto side = yaml->integer(key);
    if (!side) return side.error();
    orbslam.resolution.push_back(*side);
  }
  const char* body = yaml->has("Tbc") ? "Tbc" : "IMU.T_b_c1";
  if (yaml->has(body)) {
    const auto T_body_cam1 = transform(*yaml, body);
    if (!T_body_cam1) return T_body_cam1.error();
    orbslam.T_body_cam1 = *T_body_cam1;
  } else {
    orbslam.reading.notes.push_back("no IMU.T_b_c1: the body frame is camera 1");
  }
  if (const Status status = read_cameras(orbslam); !status) return status.error();
  return orbslam.reading;
}

Result<std::string> orbslam_rig_text(const camera::Rig& rig, const std::string& out) {
  const RigLimits limits{.format = "an ORB-SLAM3 settings file",
                         .models = {camera::Pinhole::kName, camera::PinholeRadTan::kName, camera::KannalaBrandt::kName},
                         .max_coefficients = 5,
                         .max_cameras = 2};
  if (const Status status = check_limits(rig, out, limits); !status) return status.error();
  const camera::Camera &first = rig.camera(std::size_t{0}), &last = rig.camera(rig.size() - 1);
  const auto fisheye = [](const camera::Camera& c) { return std::holds_alternative<camera::KannalaBrandt>(c.model); };
  if (fisheye(first) != fisheye(last)) {
    return Error{out, last.name, std::string(camera::model_name(last.model)), "the same Camera.type for both cameras"};
  }
  if (first.width != last.width || first.height != last.height) {
    return Error{out, last.name, fmt::format("{}x{} pixels", last.width, last.height),
                 fmt::format("{}x{} for both cameras", first.width, first.height)};
  }
  std::string text = fmt::format("%YAML:1.0\n\nFile.version: \"1.0\"\nCamera.type: \"{}\"\n\n{}",
                                 fisheye(first) ? "KannalaBrandt8" : "PinHole", model_text(first.model, 1));
  if (rig.size() == 2) {
    text += model_text(last.model, 2) + matrix_text("Stereo.T_c1_c2", rig.in_frame_of_camera_0().rig_from_cam(1)) +
            "Stereo.ThDepth: 40.0\n";
    for (int number = 1; fisheye(first) && number <= 2; ++number) {
      text += fmt::format("Camera{0}.overlappingBegin: 0\nCamera{0}.overlappingEnd: {1}\n", number, first.width - 1);
    }
  }
  text +=
      fmt::format("Camera.width: {}\nCamera.height: {}\nCamera.fps: 20\nCamera.RGB: 1\n\n", first.width, first.height);
  return text + matrix_text("IMU.T_b_c1", rig.body_from_cam(0)) +
         "# To be completed for ORB-SLAM3: the frame rate above, ORBextractor.*, Viewer.*, and IMU.* where one is "
         "used.\n";
}

}  // namespace bslam::rig_formats
