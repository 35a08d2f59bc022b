// A rig drawn to scale, from above and from the side.
#pragma once

#include <string>

#include "camera/rig.h"

namespace bslam::report {

// The whole drawing as an SVG document, in the frame of camera 0: from above (x to the right, z up the page) and from
// the right (z to the right, y down the page). Each camera with its view frustum, as its lens has it, its optical axis
// and its name; the body frame where it is not camera 0; a scale. Same rig, same bytes.
std::string rig_plot_svg(const camera::Rig& rig);

}  // namespace bslam::report
