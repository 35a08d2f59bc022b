// The test of a calibration against a few images of a recording, without a map (calibration/convention_check.h).
#pragma once

#include <optional>
#include <vector>

#include "base/result.h"
#include "calibration/camera_pairs.h"
#include "calibration/late_camera.h"
#include "dataset/dataset.h"

namespace bslam::session {

// Tests every pair of cameras with some frames spread over the data set. Errors: masks that cannot be read.
Result<std::vector<calibration::PairEvidence>> test_against_images(const dataset::Dataset& dataset);

// The camera whose images are one frame late, found with some frames spread over the data set that follow each other.
std::optional<calibration::LateCamera> late_camera(const dataset::Dataset& dataset);

// The pairs of cameras whose images show another arrangement than the calibration. For a run that started no map; the
// pairs have no keyframes. Empty for a data set without frames, such as live cameras.
std::vector<calibration::CameraPair> contradicted_pairs(const dataset::Dataset& dataset);

}  // namespace bslam::session
