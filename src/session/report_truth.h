// Comparison of a finished run with the ground truth of its data set, for the report. Ground truth is read only here,
// after the run.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>

#include "dataset/dataset.h"
#include "evaluation/trajectory.h"

namespace bslam::session {

// Errors over time of the path of camera 0, after alignment as by `bslam eval`, and its true path in the world of the
// estimate. The ground truth, which is that of the body, is moved to camera 0 with the calibration: the converse would
// add metres to a path of unknown scale. `metric`: the scale of the map is known, so that it is not aligned. Returns
// null without ground truth, and {"error": TEXT} if it cannot be used. "note" says that the calibration has no body.
// `last_ns`: the time of the last frame that was processed, if the run was interrupted before the end of the data set.
nlohmann::ordered_json report_truth(const dataset::Dataset& dataset, const evaluation::Trajectory& path, bool metric,
                                    std::optional<TimeNs> last_ns = {});

}  // namespace bslam::session
