// Cameras that capture with the same period as camera 0, but always at another time.
#pragma once

#include <span>
#include <vector>

#include "base/timestamp.h"

namespace bslam::dataset {

// Per camera: how much later than camera 0 it captures, between minus and plus half a period of camera 0. 0 for cameras
// that differ by at most `tolerance_ns`, or by no constant time: at least 90 % of the images must be within a tenth of
// the period of it. Images are compared with the nearest image of camera 0; where camera 0 has a gap, they are ignored.
// `times[i]` are the times of camera i's images, strictly increasing; camera 0 must have at least one.
std::vector<TimeNs> capture_phases(std::span<const std::vector<TimeNs>> times, TimeNs tolerance_ns);

}  // namespace bslam::dataset
