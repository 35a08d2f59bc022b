#include "rig_formats/kitti_calib.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <sstream>
#include <string>

#include "base/atomic_file.h"
#include "base/number_text.h"
#include "camera/camera_description.h"
#include "image_files/image_folder.h"

namespace bslam::rig_formats {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxCalibBytes = std::size_t{1} << 20;

// Converts the numbers of a line to a projection.
Result<KittiProjection> projection_of(const std::string& key, std::istringstream& rest, const fs::path& file) {
  const auto error = [&](std::string found, std::string expected) {
    return Error{file.string(), key, std::move(found), std::move(expected)};
  };
  std::vector<double> P;
  for (std::string word; rest >> word;) {
    const auto value = parse_double(word);
    if (!value) return error(word, "a finite number");
    P.push_back(*value);
  }
  if (P.size() != 12) return error(fmt::format("{} numbers", P.size()), "12 (rows of a 3x4 projection)");
  const double fx = P[0], fy = P[5], cx = P[2], cy = P[6];
  if (!(fx > 0 && fy > 0)) return error(fmt::format("focal lengths {} and {}", fx, fy), "positive focal lengths");
  if (P[1] != 0 || P[4] != 0 || P[8] != 0 || P[9] != 0 || P[10] != 1) {
    return error("a 3x3 part that is not rectified", "fx 0 cx, 0 fy cy, 0 0 1");
  }
  // P = K [I | t] with t = K^-1 p4; the camera centre is -t.
  const geometry::Vector3d t((P[3] - cx * P[11]) / fx, (P[7] - cy * P[11]) / fy, P[11]);
  return KittiProjection{key[1] - '0', {fx, fy, cx, cy}, -t};
}

}  // namespace

Result<std::vector<KittiProjection>> read_kitti_calib(const fs::path& file) {
  const auto text = read_text(file, kMaxCalibBytes);
  if (!text) return text.error();
  std::vector<KittiProjection> projections;
  std::istringstream lines(*text);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string key;
    words >> key;
    if (key.size() != 3 || key[0] != 'P' || key[1] < '0' || key[1] > '3' || key[2] != ':') continue;
    key.pop_back();
    const auto projection = projection_of(key, words, file);
    if (!projection) return projection.error();
    const bool again = std::any_of(projections.begin(), projections.end(),
                                   [&](const KittiProjection& p) { return p.camera == projection->camera; });
    if (again) return Error{file.string(), key, "a repeated line", "each line once"};
    projections.push_back(*projection);
  }
  if (projections.empty()) return Error{file.string(), "", "no projection", "lines P0: to P3:"};
  return projections;
}

fs::path kitti_image_folder(const fs::path& data, int camera) { return data / fmt::format("image_{}", camera); }

Result<camera::RigCamera> kitti_camera(const KittiProjection& p, int width, int height, const fs::path& calib_file) {
  const std::string key = fmt::format("P{}", p.camera);
  const geometry::Vector3d& t = p.position;
  const camera::CameraDescription description{
      .name = fmt::format("image_{}", p.camera),
      .model = std::string(camera::Pinhole::kName),
      .resolution = {width, height},
      .intrinsics = {p.intrinsics.fx, p.intrinsics.fy, p.intrinsics.cx, p.intrinsics.cy},
      .distortion = {},
      .T_body_cam = {1, 0, 0, t.x(), 0, 1, 0, t.y(), 0, 0, 1, t.z(), 0, 0, 0, 1},
      .mask_file = {}};
  return camera::make_camera(description, {calib_file.string(), key, key, key, key, key, key});
}

Result<std::vector<camera::RigCamera>> read_kitti_cameras(const fs::path& calib_file) {
  const auto projections = read_kitti_calib(calib_file);
  if (!projections) return projections.error();
  std::vector<camera::RigCamera> cameras;
  for (const KittiProjection& p : *projections) {
    const fs::path folder = kitti_image_folder(calib_file.parent_path(), p.camera);
    const auto size = image_files::first_image_size(image_files::images_in(folder));
    if (!size) continue;
    const auto camera = kitti_camera(p, size->width, size->height, calib_file);
    if (!camera) return camera.error();
    cameras.push_back(*camera);
  }
  if (cameras.empty()) {
    return Error{calib_file.string(), "", "no images in its folder",
                 "image_0 to image_3 with images, since the calibration does not contain the resolution"};
  }
  return cameras;
}

}  // namespace bslam::rig_formats
