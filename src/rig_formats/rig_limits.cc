#include "rig_formats/rig_limits.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "base/number_text.h"

namespace bslam::rig_formats {
namespace {

Status check_camera(const camera::Camera& camera, const std::string& out, const RigLimits& limits) {
  const auto error = [&](std::string found, std::string expected) {
    return Error{out, camera.name, std::move(found), std::move(expected)};
  };
  const std::string format(limits.format);
  if (!camera.mask_file.empty()) {
    return error("a mask, which " + format + " cannot store", "cameras without masks, or --drop mask");
  }
  if (limits.time_offsets == Supports::kNothing && camera.time_offset_ns != 0) {
    return error("a time offset, which " + format + " cannot store",
                 "cameras without time offsets, or --drop time-offset");
  }
  if (!limits.rolling_shutters && camera.readout_s != 0) {
    return error("a rolling shutter, which " + format + " cannot store",
                 "cameras without rolling shutters, or --drop rolling-shutter");
  }
  const std::string_view model = camera::model_name(camera.model);
  if (std::find(limits.models.begin(), limits.models.end(), model) == limits.models.end()) {
    return error(fmt::format("model {}, which {} cannot store", model, format),
                 fmt::format("one of: {}", fmt::join(limits.models, ", ")));
  }
  const std::size_t count = needed_coefficients(camera.model).size();
  if (model == camera::PinholeRadTan::kName && count > limits.max_coefficients) {
    return error(fmt::format("{} coefficients", count),
                 fmt::format("at most {}, since {} cannot store more", limits.max_coefficients, format));
  }
  return {};
}

}  // namespace

Status check_limits(const camera::Rig& rig, const std::string& out, const RigLimits& limits) {
  if (rig.size() > limits.max_cameras) {
    return Error{out, "", fmt::format("{} cameras", rig.size()),
                 fmt::format("at most {}, since {} cannot store more", limits.max_cameras, limits.format)};
  }
  const TimeNs offset = rig.camera(std::size_t{0}).time_offset_ns;
  for (std::size_t i = 0; i < rig.size(); ++i) {
    const camera::Camera& camera = rig.camera(i);
    if (const Status status = check_camera(camera, out, limits); !status) return status;
    if (limits.time_offsets == Supports::kOneForAll && camera.time_offset_ns != offset) {
      return Error{out, camera.name, "a time offset that differs from camera 0",
                   fmt::format("one time offset for all cameras, since {} cannot store more, or --drop time-offset",
                               limits.format)};
    }
  }
  if (!limits.body_frame && rig.body_from_cam(0).matrix() != Eigen::Matrix4d::Identity()) {
    return Error{out, rig.camera(std::size_t{0}).name,
                 fmt::format("a body frame, which {} cannot store", limits.format),
                 "camera 0 as the body, or --drop body"};
  }
  return {};
}

std::vector<double> needed_coefficients(const camera::CameraModel& model) {
  std::vector<double> d = camera::distortion(model);
  if (!std::holds_alternative<camera::PinholeRadTan>(model)) return d;
  if (d.size() == 8 && d[5] == 0 && d[6] == 0 && d[7] == 0) d.resize(5);
  if (d.size() == 5 && d[4] == 0) d.resize(4);
  return d;
}

std::string number_list(const std::vector<double>& values) {
  std::vector<std::string> texts;
  for (const double value : values) texts.push_back(format_double(value));
  return fmt::format("[{}]", fmt::join(texts, ", "));
}

}  // namespace bslam::rig_formats
