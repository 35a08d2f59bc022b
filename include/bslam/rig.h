// The rig: cameras, their calibration and where they are mounted.
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
struct Access;  // how the library itself reads what these classes hide
}

// Calibration of one camera. A camera looks along +z, x to the right and y down; the centre of the upper left pixel is
// pixel (0, 0).
struct CameraCalibration {
  std::string name;                                 // of its own in the rig; empty: "cam0", "cam1", ... by its place
  std::string model = "pinhole-radtan";             // pinhole, pinhole-radtan, kannala-brandt, ucm, eucm, double-sphere
  int width = 0, height = 0;                        // pixels, 1 to 20000
  std::array<double, 4> intrinsics = {0, 0, 0, 0};  // fx, fy, cx, cy in pixels
  // What the model has beside these: none; k1 k2 p1 p2 [k3 [k4 k5 k6]]; k1 k2 k3 k4; alpha; alpha beta; xi alpha.
  std::vector<double> distortion = {};
  Pose T_body_cam = {};      // metres; the body frame is any frame of your choice that all cameras share
  double time_offset_s = 0;  // true time = stamp + offset
  // (height, width) row-major; 0 = ignore these pixels, as they show the robot. Empty: none.
  std::vector<std::uint8_t> mask = {};
};

// Immutable; copies are cheap and may be used from any thread.
class BSLAM_EXPORT Rig {
 public:
  Rig(const Rig& other) = default;  // a move copies as well, so that a Rig always has cameras
  Rig& operator=(const Rig& other) = default;

  // Reads a calibration of any known format, recognised by its content: bslam, EuRoC, Kalibr, OpenVINS, ORB-SLAM3,
  // Basalt, COLMAP, KITTI; or the one that the folder of a data set holds. Errors name file and key: not readable, no
  // known format, values out of range, a mask that is no 8-bit grey PNG of the camera's size.
  static Result<Rig> load(const std::filesystem::path& file);

  // A rig made in code; the first is camera 0. Errors name the camera and what of it is wrong, as `load`; no
  // camera; a name twice.
  static Result<Rig> make(const std::vector<CameraCalibration>& cameras);

  // Some of the cameras, in this order; the first becomes camera 0. Errors: none, an index twice or out of range.
  Result<Rig> subset(const std::vector<int>& cameras) const;

  // Writes bslam's own format; masks made in code are left out. Error: the file cannot be written.
  Status save(const std::filesystem::path& file) const;

  std::size_t size() const;  // cameras
  // Copies the calibration of camera i; i below size(), anything else gives an empty one.
  CameraCalibration camera(std::size_t i) const;

  // How the file was understood where it leaves a choice, and likely mistakes of units, frames or axes; a line each.
  std::vector<std::string> notes() const;
  std::vector<std::string> warnings() const;

 private:
  friend struct api::Access;
  struct Impl;
  explicit Rig(std::shared_ptr<const Impl> impl);
  std::shared_ptr<const Impl> impl_;  // never null
};

}  // namespace bslam
