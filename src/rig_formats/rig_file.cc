#include "rig_formats/rig_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <fstream>
#include <utility>

#include "base/atomic_file.h"
#include "camera/camera_description.h"
#include "camera/unused_name.h"
#include "rig_formats/basalt_rig.h"
#include "rig_formats/colmap_rig.h"
#include "rig_formats/euroc_sensor.h"
#include "rig_formats/kalibr_rig.h"
#include "rig_formats/kitti_calib.h"
#include "rig_formats/kitti_raw_rig.h"
#include "rig_formats/okvis_rig.h"
#include "rig_formats/orbslam_rig.h"
#include "yaml/yaml_map.h"

namespace bslam::rig_formats {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxRigBytes = std::size_t{1} << 22;
constexpr const char* kSensor = "sensor.yaml";      // of a camera in EuRoC layout
constexpr std::string_view kMapBegin = "BSLAMMAP";  // docs/map_file.md
constexpr std::array<std::string_view, 3> kRecordingBegins = {"#ROSBAG V", "\x89MCAP", "SQLite format 3"};

Result<camera::RigReading> read_euroc_file(const fs::path& file, const std::string&) {
  const std::string folder = fs::absolute(file).parent_path().filename().string();
  auto camera = read_euroc_sensor(file, folder.starts_with("cam") ? folder : "cam0");
  if (!camera) return camera.error();
  return camera::RigReading{{*std::move(camera)}, {}};
}

Result<camera::RigReading> read_kitti_file(const fs::path& file, const std::string&) {
  auto cameras = read_kitti_cameras(file);
  if (!cameras) return cameras.error();
  return camera::RigReading{*std::move(cameras), {}};
}

Result<camera::RigReading> read_colmap_file(const fs::path& file, const std::string&) {
  return read_colmap_rig(fs::absolute(file).parent_path());
}

// Returns true if any line begins with `key` and a colon.
bool has_line(std::string_view text, std::string_view key) {
  const std::string start = std::string(key) + ":";
  return text.starts_with(start) || text.find("\n" + start) != std::string_view::npos;
}

bool has(std::string_view text, std::string_view part) { return text.find(part) != std::string_view::npos; }

bool is_upper_word(std::string_view word) {
  return !word.empty() && std::all_of(word.begin(), word.end(), [](unsigned char c) {
    return std::isupper(c) != 0 || std::isdigit(c) != 0 || c == '_';
  });
}

// Examines the first line that is not a comment: "ID MODEL ..." in cameras.txt, "ID COUNT CAMERA ..." in rigs.txt.
bool is_colmap_text(std::string_view text) {
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    if (line.empty() || line.front() == '#') continue;
    if (std::isdigit(static_cast<unsigned char>(line.front())) == 0) return false;
    const std::size_t space = line.find(' ');
    if (space == std::string_view::npos) return false;
    const std::string_view rest = line.substr(space + 1), word = rest.substr(0, rest.find(' '));
    return has(rest, "CAMERA ") || (is_upper_word(word) && std::isupper(static_cast<unsigned char>(word[0])) != 0);
  }
  return false;
}

struct FormatEntry {
  RigFormat format;
  std::string_view name, description;
  bool (*recognises)(std::string_view text);
  Result<camera::RigReading> (*read)(const fs::path& file, const std::string& text);
};

// The first format that recognises a file reads it, so that errors refer to the right format. The variant of OpenVINS
// is read by the reader of Kalibr.
constexpr std::array<FormatEntry, 10> kFormats = {{
    {RigFormat::kBslam, "bslam", "a bslam rig (bslam_rig: 1)",
     [](std::string_view t) { return has_line(t, "bslam_rig"); }, read_bslam_rig},
    {RigFormat::kBasalt, "basalt", "a Basalt calibration (value0: T_imu_cam)",
     [](std::string_view t) { return has(t, "\"T_imu_cam\"") || has(t, "\"value0\""); }, read_basalt_rig},
    {RigFormat::kColmap, "colmap", "a COLMAP rig (cameras.txt with rigs.txt or rig_config.json)",
     [](std::string_view t) { return has(t, "\"image_prefix\"") || has(t, "\"ref_sensor\"") || is_colmap_text(t); },
     read_colmap_file},
    {RigFormat::kOpenvins, "openvins", "an OpenVINS camera chain (cam0: T_imu_cam)",
     [](std::string_view t) { return has_line(t, "cam0") && has(t, "T_imu_cam:"); }, read_kalibr_rig},
    {RigFormat::kKalibr, "kalibr", "a Kalibr camchain (cam0: camera_model)",
     [](std::string_view t) { return has_line(t, "cam0"); }, read_kalibr_rig},
    {RigFormat::kOrbslam3, "orbslam3", "an ORB-SLAM3 settings file (Camera.type, Camera1.fx)",
     [](std::string_view t) {
       return has_line(t, "Camera.type") || has_line(t, "Camera.fx") || has_line(t, "Camera1.fx");
     },
     read_orbslam_rig},
    {RigFormat::kOkvis2, "okvis2", "an OKVIS2 configuration (cameras: T_SC)",
     [](std::string_view t) { return has_line(t, "cameras") && (has(t, "T_SC") || has(t, "image_dimension")); },
     read_okvis_rig},
    {RigFormat::kEuroc, "euroc", "an EuRoC sensor.yaml",
     [](std::string_view t) { return has_line(t, "T_BS") || has_line(t, "camera_model"); }, read_euroc_file},
    {RigFormat::kKittiRaw, "kitti-raw", "a KITTI calib_cam_to_cam.txt",
     [](std::string_view t) { return has_line(t, "P_rect_00") || has_line(t, "K_00"); }, read_kitti_raw_rig},
    {RigFormat::kKitti, "kitti", "a KITTI calib.txt",
     [](std::string_view t) { return has_line(t, "P0") || has_line(t, "P1"); }, read_kitti_file},
}};

constexpr std::array kWritable = {RigFormat::kBslam,    RigFormat::kEuroc,  RigFormat::kKalibr, RigFormat::kOpenvins,
                                  RigFormat::kOrbslam3, RigFormat::kOkvis2, RigFormat::kBasalt, RigFormat::kColmap};

Result<RigFile> as_file(Result<camera::RigReading> reading, RigFormat format) {
  if (!reading) return reading.error();
  return RigFile{camera::Rig(std::move(reading->cameras), reading->T_cam0_rig), format, std::move(reading->notes),
                 std::move(reading->topics)};
}

bool begins_with(const fs::path& file, std::string_view text) {
  std::error_code error;
  if (!fs::is_regular_file(file, error)) return false;
  std::string begin(text.size(), '\0');
  std::ifstream stream(file, std::ios::binary);
  return stream.read(begin.data(), static_cast<std::streamsize>(begin.size())) && begin == text;
}

// Bags and MCAP files, and folders with them.
bool is_recording(const fs::path& file) {
  return std::ranges::any_of(kRecordingBegins, [&](std::string_view begin) { return begins_with(file, begin); });
}

bool holds_recording(const fs::path& folder) {
  std::error_code error;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    if (is_recording(it->path())) return true;
  }
  return false;
}

Error recording_instead(const fs::path& path) {
  return {path.string(), "", "a recording",
          "a calibration; bslam rig convert RECORDING rig.yaml writes that of its CameraInfo to a file"};
}

Result<RigFile> read_folder(const fs::path& folder) {
  const std::vector<fs::path> files = files_of_rig(folder);
  if (files.empty() && holds_recording(folder)) return recording_instead(folder);
  if (files.empty()) {
    return Error{folder.string(), "", "a folder without a calibration",
                 "a folder with mav0/camN/sensor.yaml, calib.txt, calib_cam_to_cam.txt, cameras.txt or rig.yaml"};
  }
  const fs::path name = files.front().filename();
  if (name == "calib.txt") return as_file(read_kitti_file(files.front(), ""), RigFormat::kKitti);
  if (name == "cameras.txt") return as_file(read_colmap_rig(folder), RigFormat::kColmap);
  if (name != kSensor) return read_rig_file(files.front());
  camera::RigReading reading;
  for (const fs::path& file : files) {
    auto camera = read_euroc_sensor(file, file.parent_path().filename().string());
    if (!camera) return camera.error();
    reading.cameras.push_back(*std::move(camera));
  }
  return as_file(std::move(reading), RigFormat::kEuroc);
}

Status make_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) return Error{folder.string(), "", error.message(), "a folder that can be created"};
  return {};
}

Status write_text(const Result<std::string>& text, const fs::path& file) {
  if (!text) return text.error();
  return write_atomically(file, *text);
}

Status write_colmap(const camera::Rig& rig, const fs::path& folder) {
  const auto texts = colmap_rig_texts(rig, folder.string());
  if (!texts) return texts.error();
  if (const Status status = make_folder(folder); !status) return status;
  for (const auto& [name, text] : *texts) {
    if (const Status status = write_atomically(folder / name, text); !status) return status;
  }
  return {};
}

Status write_as(const camera::Rig& rig, RigFormat format, const fs::path& out, const std::vector<std::string>& topics) {
  constexpr double kRateHz = 20.0;  // files of EuRoC contain a rate, which is not used
  switch (format) {
    case RigFormat::kEuroc:
      return write_euroc_sensors(rig, out, kRateHz);
    case RigFormat::kKalibr:
      return write_text(kalibr_rig_text(rig, out.string(), topics), out);
    case RigFormat::kOpenvins:
      return write_text(openvins_rig_text(rig, out.string(), topics), out);
    case RigFormat::kOrbslam3:
      return write_text(orbslam_rig_text(rig, out.string()), out);
    case RigFormat::kOkvis2:
      return write_text(okvis_rig_text(rig, out.string()), out);
    case RigFormat::kBasalt:
      return write_text(basalt_rig_text(rig, out.string()), out);
    case RigFormat::kColmap:
      return write_colmap(rig, out);
    case RigFormat::kBslam:
      return write_atomically(out, rig_to_yaml(rig, topics));
    case RigFormat::kKitti:
    case RigFormat::kKittiRaw:
      break;
  }
  return Error{out.string(), "", std::string(format_name(format)), "a format that can be written"};
}

}  // namespace

std::string_view format_name(RigFormat format) {
  return std::find_if(kFormats.begin(), kFormats.end(), [&](const FormatEntry& f) { return f.format == format; })->name;
}

std::span<const RigFormat> writable_formats() { return kWritable; }

std::optional<RigFormat> writable_format(std::string_view name) {
  const auto* format = std::find_if(kWritable.begin(), kWritable.end(),
                                    [&](RigFormat candidate) { return format_name(candidate) == name; });
  return format == kWritable.end() ? std::nullopt : std::optional(*format);
}

RigFormat format_of_output(const fs::path& out) {
  std::error_code error;
  if (out.filename().empty() || fs::is_directory(out, error)) return RigFormat::kEuroc;
  return out.extension() == ".json" ? RigFormat::kBasalt : RigFormat::kBslam;
}

bool is_saved_map(const fs::path& file) { return begins_with(file, kMapBegin); }

Result<RigFile> read_rig_file(const fs::path& path) {
  std::error_code error;
  if (fs::is_directory(path, error)) return read_folder(path);
  if (is_saved_map(path))
    return Error{path.string(), "", "a saved map", "a calibration; bslam rig info FILE shows the cameras of a map"};
  if (is_recording(path)) return recording_instead(path);
  auto text = read_text(path, kMaxRigBytes);
  if (!text) return text.error();
  std::string names;
  for (const FormatEntry& format : kFormats) {
    if (format.recognises(*text)) return as_file(format.read(path, *text), format.format);
    names += (names.empty() ? "" : ", ") + std::string(format.description);
  }
  // A syntax error is more helpful than an unknown format.
  if (const auto yaml = yaml::YamlMap::parse(path, *text); !yaml && !yaml.error().key.empty()) return yaml.error();
  return Error{path.string(), "", "a file of unknown format", "one of: " + names};
}

std::vector<fs::path> files_of_rig(const fs::path& path) {
  std::error_code error;
  if (!fs::is_directory(path, error)) return {path};
  std::vector<fs::path> files;
  for (const fs::path& camera : camera_folders(euroc_root(path), kSensor)) files.push_back(camera / kSensor);
  for (const char* name : {"calib.txt", "cameras.txt", "calib_cam_to_cam.txt", "rig.yaml"}) {
    if (files.empty() && fs::exists(path / name, error)) files.push_back(path / name);
  }
  if (!files.empty() && files.front().filename() == "cameras.txt")
    files.insert(files.end(), {path / "rigs.txt", path / "rig_config.json"});
  return files;
}

Result<RigFile> read_joined_rigs(std::span<const fs::path> files, const RigReader& read) {
  std::vector<camera::RigCamera> cameras;
  std::vector<std::string> notes, topics;
  std::optional<RigFile> first;
  for (const fs::path& file : files) {
    auto part = read(file);
    if (!part) return part.error();
    if (files.size() > 1 && part->rig.body_from_cam(0).matrix().isIdentity(0)) {
      return Error{file.string(), "", "extrinsics relative to its camera 0 only",
                   "extrinsics relative to a body frame that all files share, such as T_cam_imu, to join them"};
    }
    for (std::size_t c = 0; c < part->rig.size(); ++c) {
      camera::RigCamera camera{part->rig.camera(c), part->rig.body_from_cam(c)};
      camera.camera.name = camera::unused_name(cameras, camera.camera.name);
      cameras.push_back(std::move(camera));
    }
    notes.insert(notes.end(), part->notes.begin(), part->notes.end());
    topics.insert(topics.end(), part->topics.begin(), part->topics.end());
    topics.resize(cameras.size());
    if (!first) first = std::move(*part);
  }
  if (files.size() == 1) return *std::move(first);
  return RigFile{camera::Rig(std::move(cameras)), first->format, std::move(notes), std::move(topics)};
}

Result<camera::Rig> read_rig(const fs::path& path) {
  auto file = read_rig_file(path);
  if (!file) return file.error();
  return std::move(file->rig);
}

Status write_rig(const camera::Rig& rig, const fs::path& file) { return write_atomically(file, rig_to_yaml(rig)); }

Result<std::vector<std::string>> write_rig_as(const camera::Rig& rig, RigFormat format, const fs::path& out,
                                              const std::vector<std::string>& topics) {
  if (const Status status = write_as(rig, format, out, topics); !status) return status.error();
  std::vector<std::string> notes;
  const bool keeps_names = format == RigFormat::kBslam || format == RigFormat::kColmap;
  for (std::size_t i = 0; i < rig.size() && !keeps_names; ++i) {
    const std::string name = fmt::format("cam{}", i);
    if (rig.camera(i).name == name) continue;
    notes.push_back(
        fmt::format("{} stores no camera names: {} becomes {}", format_name(format), rig.camera(i).name, name));
  }
  return notes;
}

std::vector<fs::path> files_written(RigFormat format, const fs::path& out, std::size_t cameras) {
  if (format == RigFormat::kColmap) return {out / "cameras.txt", out / "rigs.txt", out / "rig_config.json"};
  if (format != RigFormat::kEuroc) return {out};
  std::vector<fs::path> files;
  for (std::size_t c = 0; c < cameras; ++c) files.push_back(out / "mav0" / fmt::format("cam{}", c) / kSensor);
  return files;
}

std::vector<fs::path> files_in_the_way(RigFormat format, const fs::path& out) {
  std::vector<fs::path> candidates = files_written(format, out, 0);
  if (format == RigFormat::kEuroc) candidates = {out / "mav0"};
  std::erase_if(candidates, [](const fs::path& path) {
    std::error_code error;
    return !fs::exists(path, error);
  });
  return candidates;
}

camera::Rig without(const camera::Rig& rig, Droppable what) {
  const bool drop_body = what == Droppable::kBodyFrame;
  const camera::Rig source = drop_body ? rig.in_frame_of_camera_0() : rig;
  std::vector<camera::RigCamera> cameras;
  for (std::size_t i = 0; i < rig.size(); ++i) {
    camera::RigCamera c{rig.camera(i), drop_body ? source.rig_from_cam(i) : source.body_from_cam(i)};
    if (what == Droppable::kMasks) c.camera.mask_file.clear();
    if (what == Droppable::kTimeOffsets) c.camera.time_offset_ns = 0;
    if (what == Droppable::kRollingShutters) c.camera.readout_s = 0;
    cameras.push_back(std::move(c));
  }
  return camera::Rig(std::move(cameras), rig.cam_from_rig(0));
}

}  // namespace bslam::rig_formats
