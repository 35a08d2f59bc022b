// One frame as data of the live view: its images with keypoints, its pose, and the state of the cameras.
#pragma once

#include <cstddef>
#include <nlohmann/json.hpp>

#include "session/run_observer.h"

namespace bslam::live_view {

// `time_s`: of the frame, since the first image of the data set. The pose is that in the frame's map at present.
// web/src/live_data.ts describes the structure.
nlohmann::ordered_json frame_json(const session::ProcessedFrame& frame, double time_s);

}  // namespace bslam::live_view
