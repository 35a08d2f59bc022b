// Corrects the rotations of a rig, and the ratios of rough focal lengths, before a map is started, if they are so wrong
// that cameras with a common view share hardly any feature: the map would have to be started without metric scale, and
// with cameras that contradict each other, from which no later calibration recovers.
#pragma once

#include <optional>

#include "frame/bundled_frame.h"

namespace bslam::tracking {

// Returns the rig with corrected rotations of cameras, each relative to an earlier camera that overlaps with it. The
// corrections are estimated from descriptor matches in `frame` that do not use the calibration. If `sigma_focal`, the
// relative standard deviation of the focal lengths, is larger than 2 %, the focal lengths of these cameras are
// corrected as well, relative to those of the earlier ones. Returns nullopt unless the correction of some camera makes
// clearly more matches agree, or several that are behind the cameras as given, and most of them. Takes some 5 ms per
// pair, 50 ms if focal lengths are corrected. `given`: the rig before any correction, from which no camera is rotated
// by more than some degrees.
std::optional<camera::Rig> with_corrected_pairs(const camera::Rig& rig, const camera::Rig& given, double sigma_focal,
                                                const frame::BundledFrame& frame);

}  // namespace bslam::tracking
