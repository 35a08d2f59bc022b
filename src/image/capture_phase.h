// Cameras that capture with the same period, but always at different times.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "base/timestamp.h"

namespace bslam::image {

struct CapturePhase {
  // Whether the delay is constant: at least 90 % of the images are within a tenth of the period of one delay.
  bool constant = false;
  TimeNs later_ns = 0;  // delay of the camera, between minus and plus half a period; 0 if it is not constant

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
  // Relative to camera 0, or to each other. Camera 0 has the default value; the delay is 0 for cameras that differ from
  // the one they are compared with by at most the tolerance.
  std::vector<CapturePhase> cameras;
  TimeNs tolerance_ns = 0;  // at least a tenth of the period of cameras with which any others have constant delays

  bool operator==(const CapturePhases&) const = default;
};

// Returns the phases of cameras whose images have the times `times[i]`, strictly increasing. Cameras whose delay
// relative to camera 0 is not constant are compared with the fastest of them instead, so that they share frames among
// themselves. `tolerance_ns`: largest difference of cameras that capture together. `before`: the earlier phases of live
// cameras, which remain as long as they are right to within a tenth of the period, or half of that if the delay drifts,
// or as long as there are too few images to decide; empty if there are none. The new ones are then those of the newest
// images, if the delay drifts. Cameras slower than 1 Hz have no phase, since the images of a frame must not be more
// than a second apart.
CapturePhases capture_phases(std::span<const std::vector<TimeNs>> times, TimeNs tolerance_ns,
                             std::span<const CapturePhase> before = {});

}  // namespace bslam::image
