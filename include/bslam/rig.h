// The rig: cameras with their intrinsics and extrinsics.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "bslam/export.h"
#include "bslam/pose.h"
#include "bslam/result.h"

namespace bslam {

namespace api {
struct Access;  // gives the library access to the implementations
}

// Calibration of one camera. The camera frame has z forward, x to the right and y down; the centre of the upper left
// pixel is pixel (0, 0).
struct CameraCalibration {
  std::string name;  // unique in the rig; empty: "cam0", "cam1", ... by index
  // pinhole, pinhole-radtan, kannala-brandt, ucm, eucm, double-sphere, fov
  std::string model = "pinhole-radtan";
  int width = 0, height = 0;                        // pixels, 1 to 20000
  std::array<double, 4> intrinsics = {0, 0, 0, 0};  // fx, fy, cx, cy in pixels
  // Further parameters, by model in the above order: none; k1 k2 p1 p2 [k3 [k4 k5 k6]]; k1 k2 k3 k4; alpha; alpha beta;
  // xi alpha; w.
  std::vector<double> distortion = {};
  Pose T_body_cam = {};      // metres; the body frame can be chosen freely and is common to all cameras
  double time_offset_s = 0;  // true time = stamp + offset
  // Seconds from the exposure of the first row to that of the last; stamps are those of the middle row. 0: all rows are
  // exposed together (global shutter).
  double rolling_shutter_readout_s = 0;
  // Mask of size (height, width), row-major; 0 marks pixels to ignore, such as views of the robot. Empty if not used.
  std::vector<std::uint8_t> mask = {};
};

// Immutable; copies are cheap and may be used from any thread.
class BSLAM_EXPORT Rig {
 public:
  Rig(const Rig& other) = default;  // moving copies as well, so that a Rig always has cameras
  Rig& operator=(const Rig& other) = default;

  // Reads a calibration of any known format, recognised by its content: bslam, EuRoC, Kalibr, OpenVINS, ORB-SLAM3,
  // OKVIS2, Basalt, COLMAP, KITTI; or the calibration in the folder of a data set. Errors name file and key: a file
  // that cannot be read or has an unknown format, values out of range, a mask that is not an 8-bit grey PNG of the
  // camera's resolution.
  static Result<Rig> load(const std::filesystem::path& file);

  // Creates a rig from calibrations; the first one is camera 0. Errors: no camera; two cameras with the same name; as
  // for `load`, values out of range, with the name of the camera and the parameter.
  static Result<Rig> make(const std::vector<CameraCalibration>& cameras);

  // Returns the rig of the given cameras, in this order; the first one becomes camera 0. Errors: no index, a repeated
  // index, an index out of range.
  Result<Rig> subset(const std::vector<int>& cameras) const;

  // Writes the rig file format of bslam. Masks that were not loaded from files are written beside it: NAME_mask0.png
  // beside NAME.yaml for camera 0, and so on. Error: a file cannot be written.
  Status save(const std::filesystem::path& file) const;

  std::size_t size() const;  // number of cameras
  // Returns a copy of the calibration of camera i; an empty calibration if i >= size().
  CameraCalibration camera(std::size_t i) const;

  // How ambiguous content of the file was interpreted; one line each.
  std::vector<std::string> notes() const;
  // Likely mistakes in units, frames or axes; one line each.
  std::vector<std::string> warnings() const;

 private:
  friend struct api::Access;
  struct Impl;
  explicit Rig(std::shared_ptr<const Impl> impl);
  std::shared_ptr<const Impl> impl_;  // never null
};

}  // namespace bslam
