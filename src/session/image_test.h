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

// The camera whose images are one frame late, in the whole data set or in a half or quarter at one of its ends; found
// with some frames spread over it that follow each other. `estimated` as in find_late_camera.
std::optional<calibration::LateCamera> late_camera(const dataset::Dataset& dataset, const camera::Rig& estimated);

// The result of testing a calibration against some images, if no map was started with it or most frames were lost.
struct PairsWithoutMap {
  // Pairs whose images show another arrangement of the cameras, or of which one has mirrored images; without keyframes.
  std::vector<calibration::CameraPair> contradicted;
  int as_given = 0;  // number of pairs whose images agree with the calibration
};

// Empty for a data set without frames, such as live cameras.
PairsWithoutMap pairs_without_map(const dataset::Dataset& dataset);

}  // namespace bslam::session
