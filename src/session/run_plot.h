// Plots of a run over time: features, inliers and faults of each camera, time of frames and stages.
#pragma once

#include <string>

#include "session/run_record.h"

namespace bslam::session {

// SVG, one panel below the other over the same time: keypoints by camera; landmarks matched (thin) and inliers (bold)
// by camera, keyframes as dots at the foot, loops and relocalisations as lines; where some were not sound,
// which and why; the caller's time for a frame with the
// stages in it; the stages beside it. Stretches in which tracking was lost are shaded. Long runs are drawn as medians
// (the frame time also as maxima) over equal stretches of time.
std::string run_plot_svg(const RunRecord& record);

}  // namespace bslam::session
