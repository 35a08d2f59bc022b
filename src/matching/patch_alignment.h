// Sub-pixel alignment of a keypoint to a reference patch: where in this image lies what the reference keypoint saw.
// Removes the 0.3 - 1 px localisation noise of a detector, which is what limits stereo depth and with it the scale.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <optional>

#include "base/options.h"
#include "camera/camera.h"
#include "feature/keypoints.h"
#include "geometry/se3.h"
#include "image/pyramid.h"

namespace bslam::matching {

struct AlignmentOptions {
  int iterations = 10;        // inverse-compositional steps at most
  double max_shift_px = 2.0;  // from the guess, in pixels of the level: farther it is another corner
  double min_ncc = 0.8;       // normalised cross-correlation after alignment, below which it is not the same place
  double min_sigma_px =
      0.12;  // least standard deviation claimed, in pixels of the level: interpolation and warp errors
  double calibration_error_px =
      0.3;  // in level-0 pixels, added in quadrature: what calibrations leave unexplained, at most ...
  double min_calibration_error_px = 0.05;  // ... and at least, as far as tracking finds it (tracking/error_floor.h)

  // Standard deviation of an aligned keypoint in level-0 pixels, from that of its alignment in pixels of the level.
  double sigma(double aligned_px, double level_scale) const {
    return std::hypot(std::max(aligned_px, min_sigma_px) * level_scale, calibration_error_px);
  }

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("iterations", self.iterations, Range{1, 50}, "", "alignment steps at most");
    visitor("max_shift_px", self.max_shift_px, Range{0.1, 10}, "px of the level",
            "largest shift from the detected corner");
    visitor("min_ncc", self.min_ncc, Range{0, 1}, "", "least normalised cross-correlation of an aligned patch");
    visitor("min_sigma_px", self.min_sigma_px, Range{0.01, 5}, "px of the level",
            "least standard deviation of an aligned keypoint");
    visitor("calibration_error_px", self.calibration_error_px, Range{0, 10}, "px",
            "error of the calibration, added in quadrature: at first and at most", OptionNote{.formerly = "floor_px"});
    visitor("min_calibration_error_px", self.min_calibration_error_px, Range{0, 10}, "px",
            "the least of it that is believed; tracking finds it", OptionNote{.formerly = "least_floor_px"});
  }
};

// The map from offsets in pixels of the reference level to offsets in level-0 pixels of the target image, to second
// order (docs/math.md, section 18). The second order matters: it is even in the offset, so that leaving it out
// displaces the whole patch, in stereo pairs of fisheyes always by the same share of the disparity.
struct PatchWarp {
  Eigen::Matrix2d linear = Eigen::Matrix2d::Identity();
  Eigen::Matrix<double, 2, 3> quadratic = Eigen::Matrix<double, 2, 3>::Zero();  // of x^2, x y, y^2; per pixel

  Eigen::Vector2d operator()(const Eigen::Vector2d& offset) const {
    return linear * offset +
           quadratic * Eigen::Vector3d(offset.x() * offset.x(), offset.x() * offset.y(), offset.y() * offset.y());
  }
};

// That of a small surface around the landmark that faces the reference camera. `reference_scale` = level-0 pixels per
// pixel of the reference level. Empty where one of the cameras does not project the patch.
std::optional<PatchWarp> patch_warp(const camera::Camera& reference_camera, const camera::Camera& target_camera,
                                    const geometry::SE3& T_target_reference, const Eigen::Vector3d& point_reference,
                                    double reference_scale);

struct AlignedKeypoint {
  Eigen::Vector2d pixel;  // level-0 pixels of the target image
  double sigma = 0;       // px, level 0, per axis (of the weaker direction)
};

// Aligns `patch` in `target` by an inverse-compositional Lucas-Kanade step for translation with gain and offset (Baker
// and Matthews, IJCV 2004), starting at `guess` (level-0 pixels). `warp` as from patch_warp. Empty where it leaves the
// image, moves too far, does not converge or does not look alike.
std::optional<AlignedKeypoint> align_patch(const feature::Patch& patch, const PatchWarp& warp,
                                           const image::Pyramid& target, const Eigen::Vector2d& guess,
                                           const AlignmentOptions& options);

}  // namespace bslam::matching
