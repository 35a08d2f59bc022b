// Draws a rig to scale, from above and from the side.
#pragma once

#include <string>

#include "camera/rig.h"

namespace bslam::report {

// Returns an SVG document with two views in the frame of camera 0: from above (x to the right, z up the page) and from
// the right (z to the right, y down the page). Every camera is drawn with its view frustum, including lens distortion,
// its optical axis and its name. The body frame is drawn if it differs from camera 0, and a scale bar is added. The
// output is deterministic.
std::string rig_plot_svg(const camera::Rig& rig);

}  // namespace bslam::report
