// How much of the view of one camera another one observes as well.
#pragma once

#include <bitset>
#include <cstddef>
#include <vector>

#include "camera/camera.h"
#include "geometry/se3.h"

namespace bslam::camera {

// The cells of the images of a camera in which it observes something. The corners of the images of a fisheye may be
// black although its calibration has rays there, and a part of the view may be covered or masked.
class UsedView {
 public:
  static constexpr std::size_t kColumns = 24, kRows = 16;

  // No cell is used.
  explicit UsedView(const Camera& camera) : width_(camera.width), height_(camera.height) {}
  // All cells are used.
  static UsedView all_of(const Camera& camera);
  // The cell of the pixel, which must be in the image, and those next to it are used.
  void add(const Vector2d& pixel);

  bool contains(std::size_t column, std::size_t row) const { return used_[row * kColumns + column]; }
  // The pixel must be in the image.
  bool contains(const Vector2d& pixel) const { return contains(column_of(pixel), row_of(pixel)); }
  // The pixel at the centre of a cell.
  Vector2d centre(std::size_t column, std::size_t row) const;
  std::size_t size() const { return used_.count(); }  // cells

 private:
  std::size_t column_of(const Vector2d& pixel) const;
  std::size_t row_of(const Vector2d& pixel) const;

  double width_, height_;  // pixels
  std::bitset<kColumns * kRows> used_;
};

// The used view of a camera with the directions of its cells: unit vectors in the camera frame, of cells that have a
// ray.
struct SampledView {
  SampledView(const Camera& camera, const UsedView& used);

  const Camera* camera;
  UsedView used;
  std::vector<Vector3d> bearings;
};

// Fraction of the used view of camera a that is in the used view of camera b, in [0, 1]; the maximum over several
// distances. 0 if a uses nothing.
double overlap_share(const SampledView& a, const SampledView& b, const geometry::SE3& T_b_a);

}  // namespace bslam::camera
