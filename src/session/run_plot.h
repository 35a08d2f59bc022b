// Plots of a run over time: features, inliers and faults of every camera, and processing times.
#pragma once

#include <string>

#include "session/run_record.h"

namespace bslam::session {

// Returns an SVG document with panels that share the time axis: keypoints per camera; matched landmarks (thin) and
// inliers (bold) per camera, with keyframes as dots at the bottom and loop closures and relocalisations as vertical
// lines; camera faults with their reasons, if there were any; processing time per frame, by stage; time per call of the
// background stages. Intervals without tracking are shaded. Long runs are drawn as medians over equal intervals of
// time, the processing time also as maxima.
std::string run_plot_svg(const RunRecord& record);

}  // namespace bslam::session
