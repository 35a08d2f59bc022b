// One camera of a rig: its camera model and image size.
#pragma once

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

  std::optional<Vector2d> project(const Vector3d& point_cam) const;
  std::optional<Projection> project_with_jacobian(const Vector3d& point_cam) const;
  std::optional<Vector3d> unproject(const Vector2d& pixel) const;

  // Returns true if the pixel is at least `margin` pixels away from the image border.
  bool contains(const Vector2d& pixel, double margin = 0.0) const {
    return pixel.x() >= margin && pixel.y() >= margin && pixel.x() <= width - 1 - margin &&
           pixel.y() <= height - 1 - margin;
  }

  // Angle in radians covered by one pixel at the principal point: 1 / mean focal length.
  double radians_per_pixel() const;
};

}  // namespace bslam::camera
