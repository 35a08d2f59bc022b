// The exposure time of a V4L2 camera.
#pragma once

#include "capture/device.h"
#include "capture/video_calls.h"

namespace bslam::capture {

// Sets the exposure to automatic or to a fixed time, or leaves it as it is. Errors: the camera has no such control; a
// time outside of its range, which the error names.
Status set_exposure(VideoCalls& calls, int device, const std::string& path, const StreamRequest& request);

}  // namespace bslam::capture
