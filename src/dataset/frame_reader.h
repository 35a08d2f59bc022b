// Reads the images of one frame of a data set.
#pragma once

#include <cstddef>
#include <string>

#include "dataset/dataset.h"
#include "image/image_bundle.h"

namespace bslam::dataset {

// Reads and decodes the images of frame `index` as 8-bit grey values, and corrects their vignetting. The state of an
// image is kDamaged if its file is missing, cannot be decoded completely, or differs from the calibrated resolution, or
// if this holds for its mask, and kMissing if the camera has no image in this frame. May be called from several threads
// at the same time.
image::ImageBundle read_frame(const Dataset& dataset, std::size_t index);

// Returns file and cause of damage of an image in state kDamaged, determined by reading it again.
std::string describe_damage(const Dataset& dataset, std::size_t index, std::size_t camera);

}  // namespace bslam::dataset
