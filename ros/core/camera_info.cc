#include "core/camera_info.h"

#include <algorithm>
#include <utility>

namespace bslam_ros {
namespace {

bslam::Error wrong(const std::string& camera, const char* key, std::string found, std::string expected) {
  return {camera + ": camera_info", key, std::move(found), std::move(expected)};
}

// Sets model and coefficients, as the reader of bags does. A lens without distortion is a pinhole. Coefficients that
// are missing are zero, and ones that the model does not have must be.
bslam::Status set_distortion(const CameraInfo& info, const std::string& camera, bslam::CameraCalibration& out) {
  const std::string& name = info.distortion_model;
  const bool fisheye = name == "equidistant" || name == "fisheye" || name == "kannala_brandt";
  const bool rational = name == "rational_polynomial";
  if (!fisheye && !rational && name != "plumb_bob" && !name.empty())
    return wrong(camera, "distortion_model", "'" + name + "'",
                 "plumb_bob, rational_polynomial, equidistant or fisheye; give a rig file for other models");
  const std::size_t most = fisheye ? 4 : rational ? 8 : 5;
  const std::size_t given = info.D.size();
  const auto is_zero = [](double k) { return k == 0; };
  if (given > most && !std::all_of(info.D.begin() + static_cast<std::ptrdiff_t>(most), info.D.end(), is_zero))
    return wrong(camera, "D", std::to_string(given) + " coefficients", "at most " + std::to_string(most));
  if (!fisheye && std::all_of(info.D.begin(), info.D.end(), is_zero)) {
    out.model = "pinhole";
    return {};
  }
  out.model = fisheye ? "kannala-brandt" : "pinhole-radtan";
  out.distortion = info.D;
  out.distortion.resize(fisheye || given <= 4 ? 4 : given <= 5 || !rational ? 5 : 8, 0.0);
  return {};
}

}  // namespace

bslam::Result<bslam::CameraCalibration> to_calibration(const CameraInfo& info, const std::string& camera,
                                                       const Pose& T_base_cam) {
  if (info.K[0] == 0 || info.K[4] == 0)
    return wrong(camera, "K", "0", "the focal lengths of a calibrated camera; otherwise give a rig file");
  bslam::CameraCalibration out;
  out.name = camera;
  out.T_body_cam = T_base_cam;
  const std::size_t binning[2] = {std::max<std::size_t>(1, info.binning_x), std::max<std::size_t>(1, info.binning_y)};
  const bool whole = info.roi_width == 0 || info.roi_height == 0;
  out.width = static_cast<int>((whole ? info.width : info.roi_width) / binning[0]);
  out.height = static_cast<int>((whole ? info.height : info.roi_height) / binning[1]);
  // K is that of the sensor. The centre of a binned pixel is that of the pixels it consists of.
  const auto centre = [&](double c, std::size_t offset, std::size_t bin) {
    const double n = static_cast<double>(bin);
    return (c - (whole ? 0 : static_cast<double>(offset)) + 0.5) / n - 0.5;
  };
  out.intrinsics = {info.K[0] / static_cast<double>(binning[0]), info.K[4] / static_cast<double>(binning[1]),
                    centre(info.K[2], info.roi_x, binning[0]), centre(info.K[5], info.roi_y, binning[1])};
  if (const bslam::Status status = set_distortion(info, camera, out); !status) return status.error();
  return out;
}

bslam::Result<bslam::Rig> make_rig(const std::vector<CameraInfo>& infos, const std::vector<std::string>& cameras,
                                   const std::vector<Pose>& T_base_cam) {
  std::vector<bslam::CameraCalibration> calibrations;
  for (std::size_t c = 0; c < infos.size(); ++c) {
    for (std::size_t other = 0; other < c; ++other) {
      if (infos[other].frame_id == infos[c].frame_id)
        return wrong(cameras[c], "frame_id", "'" + infos[c].frame_id + "', which is also that of " + cameras[other],
                     "a frame of its own, as drivers of raw images have it; otherwise give a rig file");
    }
    auto calibration = to_calibration(infos[c], cameras[c], T_base_cam[c]);
    if (!calibration) return calibration.error();
    calibrations.push_back(*std::move(calibration));
  }
  return bslam::Rig::make(calibrations);
}

}  // namespace bslam_ros
