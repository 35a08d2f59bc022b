// Sub-pixel alignment of a keypoint to a reference patch: finds the position in this image that shows the same surface
// as the reference keypoint. Reduces the 0.3 - 1 px localisation noise of the detector, which would otherwise limit the
// accuracy of stereo depth and of the scale, to about 0.1 px.
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
  int iterations = 10;        // maximum number of inverse-compositional steps
  double max_shift_px = 2.0;  // px of the level, maximum distance from the initial position; farther is another corner
  double min_ncc = 0.8;       // minimum normalised cross-correlation after alignment
  // px of the level, lower bound of the standard deviation; covers errors of interpolation and of the warp
  double min_sigma_px = 0.12;
  // Level-0 pixels, added in quadrature: initial value of the calibration error, and the bounds between which tracking
  // estimates it (tracking/calibration_error.h).
  double calibration_error_px = 0.3;
  double min_calibration_error_px = 0.05, max_calibration_error_px = 10.0;

  // Standard deviation of an aligned keypoint in level-0 pixels. `aligned_px`: standard deviation of its alignment in
  // pixels of the level.
  double sigma(double aligned_px, double level_scale) const {
    return std::hypot(std::max(aligned_px, min_sigma_px) * level_scale, calibration_error_px);
  }

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("iterations", self.iterations, Range{1, 50}, "", "maximum number of alignment steps");
    visitor("max_shift_px", self.max_shift_px, Range{0.1, 10}, "px of the level",
            "maximum shift from the detected corner");
    visitor("min_ncc", self.min_ncc, Range{0, 1}, "", "minimum normalised cross-correlation of an aligned patch");
    visitor("min_sigma_px", self.min_sigma_px, Range{0.01, 5}, "px of the level",
            "minimum standard deviation of an aligned keypoint");
    visitor("calibration_error_px", self.calibration_error_px, Range{0, 10}, "px",
            "initial value of the calibration error estimated by tracking", OptionNote{.formerly = "floor_px"});
    visitor("max_calibration_error_px", self.max_calibration_error_px, Range{0, 10}, "px",
            "upper bound of the calibration error estimated by tracking");
    visitor("min_calibration_error_px", self.min_calibration_error_px, Range{0, 10}, "px",
            "lower bound of the calibration error estimated by tracking", OptionNote{.formerly = "least_floor_px"});
  }
};

// The map from offsets in pixels of the reference level to offsets in level-0 pixels of the target image, to second
// order (docs/math.md, section 18). The second order is even in the offset, so that neglecting it displaces the whole
// patch; in stereo pairs of fisheyes this is a systematic error proportional to the disparity.
struct PatchWarp {
  Eigen::Matrix2d linear = Eigen::Matrix2d::Identity();
  // Coefficients of x^2, x y, y^2, in 1/pixel.
  Eigen::Matrix<double, 2, 3> quadratic = Eigen::Matrix<double, 2, 3>::Zero();

  Eigen::Vector2d operator()(const Eigen::Vector2d& offset) const {
    return linear * offset +
           quadratic * Eigen::Vector3d(offset.x() * offset.x(), offset.x() * offset.y(), offset.y() * offset.y());
  }
};

// The warp by a small plane through the landmark that faces the reference camera. `point_reference`: the landmark in
// the frame of the reference camera. `reference_scale`: level-0 pixels per pixel of the reference level. Returns
// nullopt if one of the cameras cannot project the patch.
std::optional<PatchWarp> patch_warp(const camera::Camera& reference_camera, const camera::Camera& target_camera,
                                    const geometry::SE3& T_target_reference, const Eigen::Vector3d& point_reference,
                                    double reference_scale);

struct AlignedKeypoint {
  Eigen::Vector2d pixel;  // level-0 pixels of the target image
  double sigma = 0;       // level-0 pixels, standard deviation in the least certain direction
};

// Aligns `patch` in `target` by inverse-compositional Lucas-Kanade steps for translation with gain and offset (Baker
// and Matthews, IJCV 2004), starting at `initial` (level-0 pixels). `warp`: see patch_warp. Returns nullopt if the
// patch leaves the image, moves farther than max_shift_px, does not converge, or correlates too little with the result.
std::optional<AlignedKeypoint> align_patch(const feature::Patch& patch, const PatchWarp& warp,
                                           const image::Pyramid& target, const Eigen::Vector2d& initial,
                                           const AlignmentOptions& options);

}  // namespace bslam::matching
