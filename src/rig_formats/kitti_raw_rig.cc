#include "rig_formats/kitti_raw_rig.h"

#include <fmt/format.h>

#include <map>
#include <optional>
#include <sstream>
#include <utility>
#include <vector>

#include "base/number_text.h"
#include "image_files/image_folder.h"

namespace bslam::rig_formats {
namespace {

namespace fs = std::filesystem;
using geometry::SE3;

constexpr int kCameras = 4;

// The lines "KEY: numbers" of the file, except for the line with the date.
struct Table {
  std::string file;
  std::map<std::string, std::vector<double>> rows;

  bool has(const std::string& key) const { return rows.contains(key); }
  Result<std::vector<double>> numbers(const std::string& key, std::size_t count) const {
    const auto row = rows.find(key);
    if (row == rows.end()) return Error{file, key, "nothing", fmt::format("{} numbers", count)};
    if (row->second.size() == count) return row->second;
    return Error{file, key, fmt::format("{} numbers", row->second.size()), fmt::format("{}", count)};
  }
};

Result<Table> table_of(const fs::path& file, const std::string& text) {
  Table table{file.string(), {}};
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    const std::size_t colon = line.find(':');
    if (colon == std::string::npos) continue;
    const std::string key = line.substr(0, colon);
    if (key == "calib_time") continue;
    std::istringstream words(line.substr(colon + 1));
    std::vector<double> numbers;
    for (std::string word; words >> word;) {
      const auto value = parse_double(word);
      if (!value) return Error{file.string(), key, word, "a finite number"};
      numbers.push_back(*value);
    }
    if (!table.rows.emplace(key, numbers).second) return Error{file.string(), key, "a repeated line", "each line once"};
  }
  return table;
}

enum class KittiRig { kRaw, kRectified };
struct Choice {
  KittiRig rig;
  std::string because;
};

// Chooses the rig by the size of the images in the folder of the calibration, in one of the usual folder layouts.
std::optional<Choice> by_images(const fs::path& folder, const Table& table) {
  for (int c = 0; c < kCameras; ++c) {
    const auto raw = table.numbers(fmt::format("S_0{}", c), 2);
    const auto rectified = table.numbers(fmt::format("S_rect_0{}", c), 2);
    if (!raw || !rectified || *raw == *rectified) continue;
    for (const fs::path& images : {folder / fmt::format("image_0{}", c) / "data", folder / fmt::format("image_0{}", c),
                                   folder / fmt::format("image_{}", c)}) {
      const auto size = image_files::first_image_size(image_files::images_in(images));
      if (!size) continue;
      const std::vector<double> sides = {static_cast<double>(size->width), static_cast<double>(size->height)};
      if (sides == *raw) return Choice{KittiRig::kRaw, "the images in its folder have that size"};
      if (sides == *rectified) return Choice{KittiRig::kRectified, "the images in its folder have that size"};
    }
  }
  return std::nullopt;
}

std::optional<KittiRig> by_name(const fs::path& folder) {
  const std::string name = folder.filename().string();
  if (name.ends_with("_extract")) return KittiRig::kRaw;
  if (name.ends_with("_sync")) return KittiRig::kRectified;
  return std::nullopt;
}

Choice choose(const fs::path& file, const Table& table) {
  const fs::path folder = fs::absolute(file).parent_path();
  if (const auto choice = by_images(folder, table)) return *choice;
  for (fs::path part = folder; part.has_relative_path(); part = part.parent_path()) {
    if (const auto rig = by_name(part)) return {*rig, "because of the folder " + part.filename().string()};
  }
  bool raw = false, rectified = false;
  std::error_code error;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    const auto rig = by_name(it->path());
    raw = raw || rig == KittiRig::kRaw;
    rectified = rectified || rig == KittiRig::kRectified;
  }
  if (raw && !rectified) return {KittiRig::kRaw, "only folders ending in _extract are next to it"};
  return {KittiRig::kRectified, rectified ? "folders ending in _sync are next to it" : "by default"};
}

Result<SE3> describe_raw(const Table& table, const std::string& n, camera::CameraDescription& d) {
  const auto K = table.numbers("K_" + n, 9), R = table.numbers("R_" + n, 9), T = table.numbers("T_" + n, 3);
  const auto D = table.numbers("D_" + n, 5);
  for (const auto* part : {&K, &R, &T, &D}) {
    if (!*part) return part->error();
  }
  const auto &r = *R, &t = *T, &k = *K;
  const auto T_cam_reference = camera::rigid_transform(
      {r[0], r[1], r[2], t[0], r[3], r[4], r[5], t[1], r[6], r[7], r[8], t[2], 0, 0, 0, 1}, table.file, "R_" + n);
  if (!T_cam_reference) return T_cam_reference.error();
  d.model = camera::PinholeRadTan::kName;
  d.intrinsics = {k[0], k[4], k[2], k[5]};
  d.distortion = *D;
  return T_cam_reference->inverse();
}

Result<SE3> describe_rectified(const Table& table, const std::string& n, camera::CameraDescription& d) {
  const auto P_rect = table.numbers("P_rect_" + n, 12);
  if (!P_rect) return P_rect.error();
  const auto& P = *P_rect;
  const double fx = P[0], fy = P[5], cx = P[2], cy = P[6];
  if (P[1] != 0 || P[4] != 0 || P[8] != 0 || P[9] != 0 || P[10] != 1 || !(fx > 0 && fy > 0)) {
    return Error{table.file, "P_rect_" + n, "a 3x3 part that is not rectified", "fx 0 cx, 0 fy cy, 0 0 1"};
  }
  d.model = camera::Pinhole::kName;
  d.intrinsics = {fx, fy, cx, cy};
  // P = K [I | t]: the camera centre is -t.
  const geometry::Vector3d t((P[3] - cx * P[11]) / fx, (P[7] - cy * P[11]) / fy, P[11]);
  return SE3(geometry::Quaterniond::Identity(), -t);
}

}  // namespace

Result<camera::RigReading> read_kitti_raw_rig(const fs::path& file, const std::string& text) {
  const auto table = table_of(file, text);
  if (!table) return table.error();
  const Choice choice = choose(file, *table);
  const bool raw = choice.rig == KittiRig::kRaw;
  camera::RigReading reading;
  for (int c = 0; c < kCameras; ++c) {
    const std::string n = fmt::format("0{}", c);
    if (!table->has((raw ? "K_" : "P_rect_") + n)) continue;
    camera::CameraDescription d;
    d.name = "image_" + n;
    const std::string size_key = (raw ? "S_" : "S_rect_") + n;
    const auto sides = table->numbers(size_key, 2);
    if (!sides) return sides.error();
    auto resolution = camera::whole_pixels(*sides, table->file, size_key);
    if (!resolution) return resolution.error();
    d.resolution = *std::move(resolution);
    const auto T_body_cam = raw ? describe_raw(*table, n, d) : describe_rectified(*table, n, d);
    if (!T_body_cam) return T_body_cam.error();
    d.T_body_cam = camera::rows_of(*T_body_cam);
    const std::string key = (raw ? "K_" : "P_rect_") + n;
    auto camera = camera::make_camera(d, {table->file, key, size_key, key, "D_" + n, (raw ? "T_" : "P_rect_") + n, ""});
    if (!camera) return camera.error();
    reading.cameras.push_back(*std::move(camera));
  }
  if (reading.cameras.empty())
    return Error{table->file, "", "no camera", raw ? "K_00 to K_03" : "P_rect_00 to P_rect_03"};
  reading.notes.push_back(
      fmt::format("read as the {} cameras of KITTI raw: {}", raw ? "unrectified" : "rectified", choice.because));
  return reading;
}

}  // namespace bslam::rig_formats
