// Cameras that capture with the same period as camera 0, but always at another time.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "base/timestamp.h"

namespace bslam::image {

struct CapturePhase {
  // Whether the delay is constant: at least 90 % of the images are within a tenth of the period of camera 0 of one
  // delay.
  bool constant = false;
  // Delay of the camera relative to camera 0, between minus and plus half a period; 0 if it is not constant.
  TimeNs later_ns = 0;

  bool operator==(const CapturePhase&) const = default;
};

// Images are compared with the nearest image of camera 0; where camera 0 has a gap, they are ignored. Returns nullopt
// if fewer than 5 images can be compared, or less than half of those between the first and the last of camera 0.
// `camera0` and `times` are the times of the images of both, strictly increasing; `camera0` has at least one, and
// `period_ns`, its period, is positive.
std::optional<CapturePhase> capture_phase(const std::vector<TimeNs>& camera0, const std::vector<TimeNs>& times,
                                          TimeNs period_ns);

// Returns `time_ns` plus the multiple of the positive period with which it is between minus and plus half a period.
TimeNs wrapped(TimeNs time_ns, TimeNs period_ns);

// How images are grouped into frames by image/frame_grouping.h: those of each camera as if they had been captured
// `later_ns` earlier, with this tolerance.
struct CapturePhases {
  // The default value for camera 0. The delay is 0 for cameras that differ from camera 0 by at most the tolerance.
  std::vector<CapturePhase> cameras;
  TimeNs tolerance_ns = 0;  // at least a tenth of the period of camera 0 if the phase of any other camera is constant

  bool operator==(const CapturePhases&) const = default;
};

// Returns the phases of cameras whose images have the times `times[i]`, strictly increasing. Those of camera 0 are at
// least one. `tolerance_ns`: largest difference of cameras that capture together. `before`: the earlier phases of live
// cameras, which remain as long as they are right to within a tenth of the period, or half of that if the delay
// drifts, or as long as there are too few images to decide; empty if there are none. The new ones are then those of the
// newest images, if the delay drifts. Cameras slower than 1 Hz have no phase, since the images of a frame must
// not be more than a second apart.
CapturePhases capture_phases(std::span<const std::vector<TimeNs>> times, TimeNs tolerance_ns,
                             std::span<const CapturePhase> before = {});

}  // namespace bslam::image
