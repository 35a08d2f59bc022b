// Recognises the image of a keyframe by its keypoints.
#pragma once

#include <optional>

#include "feature/feature_model.h"
#include "feature/keypoints.h"
#include "image/image.h"

namespace bslam::map_export {

// Share of the keypoints with a descriptor similar to that at their position in this image; nullopt without keypoints.
// A sample of them is compared.
std::optional<double> share_shown(const image::Image& image, const feature::Keypoints& keypoints,
                                  const feature::PyramidShape& shape);

}  // namespace bslam::map_export
