// A picture of the mean image residuals of every camera: their pattern shows a wrong distortion or focal length.
#pragma once

#include <vector>

#include "report/figure.h"
#include "session/run_record.h"

namespace bslam::session {

// Returns rows of panels, one panel per camera with observations: the image with an arrow from the centre of every cell
// in the direction of its mean residual (observed minus projected), magnified equally in all panels, and a scale bar.
std::vector<report::PanelRow> residual_rows(const RunRecord& record);

}  // namespace bslam::session
