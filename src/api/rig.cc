#include <bslam/rig.h>
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "api/access.h"
#include "api/conversions.h"
#include "api/guard.h"
#include "api/rig_impl.h"
#include "base/atomic_file.h"
#include "calibration/rig_warnings.h"
#include "camera/camera_description.h"
#include "image_files/mask.h"
#include "image_files/png_decoder.h"
#include "image_files/png_encoder.h"
#include "rig_formats/rig_file.h"

namespace bslam {
namespace {

constexpr std::size_t kMaxMaskBytes = std::size_t{1} << 30;

Result<image::Image> read_mask(const camera::Camera& camera) {
  if (camera.mask_file.empty()) return image::Image();
  if (const auto recording = image_files::recording_around(camera.mask_file))
    return Error{camera.mask_file, "", "a mask inside of the recording " + recording->string(),
                 "a PNG file: the library reads no recordings; mask: FILE in the rig file names another one"};
  const auto bytes = read_file(camera.mask_file, kMaxMaskBytes);
  if (!bytes) return bytes.error();
  auto mask = image_files::is_complete_png(*bytes) ? image_files::decode_grey_png(*bytes) : std::nullopt;
  if (!mask)
    return Error{camera.mask_file, "", "a damaged file or another format",
                 "a complete 8-bit grey PNG without interlacing"};
  return image_files::checked_mask(*std::move(mask), camera);
}

// Returns the camera and its mask, which may be empty. `key` is the key of the camera in errors.
Result<std::pair<camera::RigCamera, image::Image>> make_camera(const CameraCalibration& c, const std::string& key) {
  const auto& q = c.T_body_cam.rotation;
  const auto& t = c.T_body_cam.translation;
  const auto T_body_cam = camera::rigid_transform(geometry::Quaterniond(q[3], q[0], q[1], q[2]),
                                                  geometry::Vector3d(t[0], t[1], t[2]), key, "T_body_cam");
  if (!T_body_cam) return T_body_cam.error();
  const camera::CameraDescription description{.name = c.name,
                                              .model = c.model,
                                              .resolution = {c.width, c.height},
                                              .intrinsics = {c.intrinsics.begin(), c.intrinsics.end()},
                                              .distortion = c.distortion,
                                              .T_body_cam = camera::rows_of(*T_body_cam),
                                              .time_offset_s = c.time_offset_s,
                                              .mask_file = "",
                                              .readout_s = c.rolling_shutter_readout_s};
  auto made = camera::make_camera(description, {key, "model", "width, height", "intrinsics", "distortion", "T_body_cam",
                                                "time_offset_s", "rolling_shutter_readout_s"});
  if (!made) return made.error();
  image::Image mask;
  if (!c.mask.empty()) {
    if (c.mask.size() != static_cast<std::size_t>(c.width) * static_cast<std::size_t>(c.height)) {
      return Error{key, "mask", fmt::format("{} pixels", c.mask.size()), fmt::format("{}x{}", c.width, c.height)};
    }
    mask.resize(c.width, c.height);
    std::ranges::copy(c.mask, mask.row(0));
    auto checked = image_files::checked_mask(std::move(mask), made->camera);
    if (!checked) return Error{key, "mask", checked.error().found, checked.error().expected};
    mask = *std::move(checked);
  }
  return std::pair(*std::move(made), std::move(mask));
}

// Writes the masks that are in memory only, and returns the rig that names them: FILE_mask0.png and so on.
Result<camera::Rig> with_mask_files(const camera::Rig& rig, const std::vector<image::Image>& masks,
                                    const std::filesystem::path& file) {
  std::vector<camera::RigCamera> cameras;
  bool written = false;
  for (std::size_t c = 0; c < rig.size(); ++c) {
    cameras.push_back({rig.camera(c), rig.body_from_cam(c)});
    camera::Camera& camera = cameras.back().camera;
    if (masks[c].empty() || !camera.mask_file.empty()) continue;
    camera.mask_file = fmt::format("{}_mask{}.png", file.stem().string(), c);
    const Status status =
        write_atomically(file.parent_path() / camera.mask_file, image_files::encode_grey_png(masks[c]));
    if (!status) return status.error();
    written = true;
  }
  return written ? camera::Rig(std::move(cameras), rig.cam_from_rig(0)) : rig;
}

}  // namespace

Rig api::make_rig(camera::Rig rig, std::vector<image::Image> masks, std::vector<std::string> notes) {
  masks.resize(rig.size());
  return Access::make<Rig>(std::move(rig), std::move(masks), std::move(notes));
}

Rig::Rig(std::shared_ptr<const Impl> impl) : impl_(std::move(impl)) {}

Result<Rig> Rig::load(const std::filesystem::path& file) {
  return api::guarded("Rig::load", [&]() -> Result<Rig> {
    auto read = rig_formats::read_rig_file(file);
    if (!read) return read.error();
    std::vector<image::Image> masks;
    for (std::size_t c = 0; c < read->rig.size(); ++c) {
      auto mask = read_mask(read->rig.camera(c));
      if (!mask) return mask.error();
      masks.push_back(*std::move(mask));
    }
    return api::make_rig(std::move(read->rig), std::move(masks), std::move(read->notes));
  });
}

Result<Rig> Rig::make(const std::vector<CameraCalibration>& cameras) {
  return api::guarded("Rig::make", [&]() -> Result<Rig> {
    if (cameras.empty()) return Error{"Rig::make", "", "no camera", "at least one camera"};
    std::vector<camera::RigCamera> made;
    std::vector<image::Image> masks;
    for (std::size_t c = 0; c < cameras.size(); ++c) {
      CameraCalibration calibration = cameras[c];
      if (calibration.name.empty()) calibration.name = fmt::format("cam{}", c);
      const std::string key = fmt::format("camera {} ({})", c, calibration.name);
      const bool taken = std::ranges::any_of(made, [&](const auto& m) { return m.camera.name == calibration.name; });
      if (taken) return Error{"Rig::make", key, "", "", "an earlier camera has this name; names must be unique"};
      auto camera = make_camera(calibration, key);
      if (!camera) return camera.error();
      made.push_back(std::move(camera->first));
      masks.push_back(std::move(camera->second));
    }
    return api::make_rig(camera::Rig(std::move(made)), std::move(masks));
  });
}

Result<Rig> Rig::subset(const std::vector<int>& cameras) const {
  return api::guarded("Rig::subset", [&]() -> Result<Rig> {
    if (cameras.empty()) return Error{"Rig::subset", "", "no camera", "at least one camera"};
    std::vector<image::Image> masks;
    for (std::size_t i = 0; i < cameras.size(); ++i) {
      const int c = cameras[i];
      if (c < 0 || static_cast<std::size_t>(c) >= size()) {
        return Error{"Rig::subset", "", std::to_string(c), fmt::format("cameras in [0, {}]", size() - 1)};
      }
      if (std::count(cameras.begin(), cameras.end(), c) > 1) {
        return Error{"Rig::subset", "", fmt::format("camera {} twice", c), "each camera at most once"};
      }
      masks.push_back(impl_->masks[static_cast<std::size_t>(c)]);
    }
    return api::make_rig(impl_->rig.subset(cameras), std::move(masks), impl_->notes);
  });
}

Status Rig::save(const std::filesystem::path& file) const {
  return api::guarded("Rig::save", [&]() -> Status {
    const auto named = with_mask_files(impl_->rig, impl_->masks, file);
    return named ? rig_formats::write_rig(*named, file) : named.error();
  });
}

std::size_t Rig::size() const { return impl_->rig.size(); }

CameraCalibration Rig::camera(std::size_t i) const {
  if (i >= size()) return {};
  const camera::Camera& camera = impl_->rig.camera(i);
  const camera::Intrinsics& k = camera::intrinsics(camera.model);
  CameraCalibration out;
  out.name = camera.name;
  out.model = camera::model_name(camera.model);
  out.width = camera.width;
  out.height = camera.height;
  out.intrinsics = {k.fx, k.fy, k.cx, k.cy};
  out.distortion = camera::distortion(camera.model);
  out.T_body_cam = api::to_pose(impl_->rig.body_from_cam(i));
  out.time_offset_s = to_seconds(camera.time_offset_ns);
  out.rolling_shutter_readout_s = camera.readout_s;
  const image::Image& mask = impl_->masks[i];
  if (!mask.empty()) out.mask.assign(mask.row(0), mask.row(mask.height() - 1) + mask.width());
  return out;
}

std::vector<std::string> Rig::notes() const { return impl_->notes; }

std::vector<std::string> Rig::warnings() const { return calibration::rig_warnings(impl_->rig); }

}  // namespace bslam
