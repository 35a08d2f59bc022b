// The images of one frame of a data set.
#pragma once

#include <cstddef>
#include <string>

#include "dataset/dataset.h"
#include "image/image_bundle.h"

namespace bslam::dataset {

// Reads and decodes the images of frame `index` as 8-bit grey. An image that is missing on disk, cannot be decoded
// whole, or is not of its camera's resolution is kDamaged; a camera without one at this instant is kMissing. Keeps no
// state: frames may be read from several threads at a time.
image::ImageBundle read_frame(const Dataset& dataset, std::size_t index);

// File and cause of an image that is kDamaged, found by reading it again.
std::string why_damaged(const Dataset& dataset, std::size_t index, std::size_t camera);

}  // namespace bslam::dataset
