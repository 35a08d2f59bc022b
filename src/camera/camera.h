// One camera of a rig: its camera model and image size.
#pragma once

#include <algorithm>
#include <optional>
#include <string>

#include "base/timestamp.h"
#include "camera/camera_model.h"

namespace bslam::camera {

struct Camera {
  std::string name;
  CameraModel model;
  int width = 0, height = 0;  // pixels
  TimeNs time_offset_ns = 0;  // true time = timestamp + offset
  std::string mask_file;      // image in which 0 marks pixels to ignore; empty if there is none
  // Rolling shutter: seconds from the exposure of the first row to that of the last; timestamps are those of the middle
  // row. Negative if the last row is exposed first. 0: all rows are exposed together.
  double readout_s = 0;

  std::optional<Vector2d> project(const Vector3d& point_cam) const;
  std::optional<Projection> project_with_jacobian(const Vector3d& point_cam) const;
  std::optional<Vector3d> unproject(const Vector2d& pixel) const;

  // Returns true if the pixel is at least `margin` pixels away from the image border.
  bool contains(const Vector2d& pixel, double margin = 0.0) const {
    return pixel.x() >= margin && pixel.y() >= margin && pixel.x() <= width - 1 - margin &&
           pixel.y() <= height - 1 - margin;
  }

  // The height of a row in the image: -1/2 for the first, 1/2 for the last.
  double relative_row(double pixel_y) const { return pixel_y / std::max(1, height - 1) - 0.5; }

  // Angle in radians covered by one pixel at the principal point: 1 / mean focal length.
  double radians_per_pixel() const;
};

// The camera with focal lengths that are longer by this factor.
Camera zoomed(Camera camera, double factor);

}  // namespace bslam::camera
