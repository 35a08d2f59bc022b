// Capture times in bundle adjustment, for cameras whose time stamps have errors
// (frame::CameraFrame::stamp_variance_s2).
#pragma once

#include "adjustment/bundle_problem.h"
#include "map/map_edit.h"

namespace bslam::adjustment {

// Corrects the capture times of the images of a problem, and the free poses with them, by one step with constant
// points. The prior of the errors is that of the keyframe with the largest variance: the first keyframes were created
// before it was known. Returns the corrections; the motions of the problem contain them.
std::vector<map::CaptureTime> correct_capture_times(const map::BundledMap& map, BundleProblem& selected);

}  // namespace bslam::adjustment
