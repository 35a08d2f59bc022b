// Recognises the image of a keyframe by its keypoints.
#pragma once

#include "feature/feature_model.h"
#include "feature/keypoints.h"
#include "image/image.h"

namespace bslam::map_export {

// Whether the keypoints may have been detected in this image: the descriptors at their positions are similar to theirs
// more often than by chance. A sample of them is compared.
bool shows(const image::Image& image, const feature::Keypoints& keypoints, const feature::PyramidShape& shape);

}  // namespace bslam::map_export
