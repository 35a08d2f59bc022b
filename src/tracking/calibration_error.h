// Calibration error of each camera: the standard deviation of the reprojection errors of aligned keypoints that is not
// explained by their alignment. It is caused by errors of the calibration and the time stamps, and by curved surfaces.
//
// It determines the weight of an aligned keypoint relative to a detected one and the threshold for outliers. Because it
// differs much between rigs, it is estimated from the tracked frames. With the squared errors e^2 of a camera's inliers
// to the map and the variances s^2 of their alignment, each frame gives
//     calibration_error^2 = median(e^2) / (2 ln 2) - median(s^2),
// because the median of the squared length of a normal error of variance 1 per axis is 2 ln 2.
#pragma once

#include <span>
#include <vector>

#include "matching/patch_alignment.h"
#include "tracking/track.h"

namespace bslam::tracking {

// Calibration errors in level-0 pixels per camera, updated with `frame`, which was tracked with `output`. `before`: the
// errors before this frame (empty: options.calibration_error_px for all cameras). They converge to new measurements
// within about ten frames and are bounded by options.min_calibration_error_px and options.max_calibration_error_px. The
// error of a camera with few matches does not change. After a lost frame they are at least
// options.calibration_error_px, because the cause of the loss may persist. Keyframes keep the standard deviations
// assigned when they were created.
std::vector<double> calibration_errors(std::span<const double> before, const map::BundledMap& map,
                                       const frame::BundledFrame& frame, const TrackOutput& output,
                                       const matching::AlignmentOptions& options);
// The update of one camera. `squared_errors`: of its keypoints, px^2. `variances`: of its keypoints, px^2, without the
// calibration error.
double update_calibration_error(double before, std::vector<double> squared_errors, std::vector<double> variances,
                                const matching::AlignmentOptions& options);

// Alignment options per camera: `options` with options.calibration_error_px replaced by the camera's entry in `errors`,
// if there is one.
std::vector<matching::AlignmentOptions> alignment_by_camera(const matching::AlignmentOptions& options,
                                                            std::span<const double> errors, std::size_t cameras);

}  // namespace bslam::tracking
