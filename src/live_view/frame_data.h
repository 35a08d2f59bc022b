// One frame as data of the live view: its images with keypoints, its pose, and the state of the cameras.
#pragma once

#include <cstddef>
#include <nlohmann/json.hpp>

#include "session/run_observer.h"

namespace bslam::live_view {

// `time_s`: time of the frame in seconds since the first image of the data set. The pose is relative to the map as it
// is now. web/src/live_data.ts describes the structure.
nlohmann::ordered_json frame_json(const session::ProcessedFrame& frame, double time_s);

}  // namespace bslam::live_view
