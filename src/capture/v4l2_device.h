// Cameras of Linux (Video4Linux2): USB webcams and others with the driver's own memory for images (streaming by mmap).
#pragma once

#include "capture/device.h"
#include "capture/video_calls.h"

namespace bslam::capture {

// Times of images are those of the driver, moved by StreamRequest::clock_offset_ns; if it has none, those of arrival.
Result<std::unique_ptr<Device>> open_v4l2(VideoCalls& calls, const std::string& path);

}  // namespace bslam::capture
