// How far aligned keypoints of each camera lie from where they should beyond what their alignment explains: what the
// calibration gets wrong, images not taken quite when they say, surfaces that are not flat.
//
// It decides how much more an aligned keypoint tells than a detected one, and above which error it is an outlier, and
// it differs much from rig to rig; so it is taken from the frames tracked so far. With squared errors e^2 of a camera's
// inliers against the map and variances s^2 of their alignment alone, each frame says
//     floor^2 = median(e^2) / (2 ln 2) - median(s^2),
// the median of the squared length of a normal error of variance 1 per axis being 2 ln 2.
#pragma once

#include <span>
#include <vector>

#include "matching/patch_alignment.h"
#include "tracking/track.h"

namespace bslam::tracking {

// Floors in level-0 pixels after `frame` was tracked with `output`; `before`: those it was tracked with (empty: nothing
// is known, options.calibration_error_px everywhere). They follow what frames say within some ten of them, between
// options.min_calibration_error_px and options.calibration_error_px. A camera with few matches keeps its own; after a
// lost frame nothing is known, as what made it lost may have come to stay. Keyframes keep the standard deviations of
// their time.
std::vector<double> error_floors(std::span<const double> before, const map::BundledMap& map,
                                 const frame::BundledFrame& frame, const TrackOutput& output,
                                 const matching::AlignmentOptions& options);
// The same for one camera, from squared errors of its keypoints and their variances, px^2, without the floor.
double error_floor(double before, std::vector<double> squared_errors, std::vector<double> variances,
                   const matching::AlignmentOptions& options);

// The options of each of `cameras` cameras: with the floors in place of options.calibration_error_px (`floors` empty:
// as they are).
std::vector<matching::AlignmentOptions> alignment_by_camera(const matching::AlignmentOptions& options,
                                                            std::span<const double> floors, std::size_t cameras);

}  // namespace bslam::tracking
