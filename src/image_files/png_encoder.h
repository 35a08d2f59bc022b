// An encoder for 8-bit grey PNGs (ISO/IEC 15948), for masks.
#pragma once

#include <string>

#include "image/image.h"

namespace bslam::image_files {

// Returns the file of an image, which has pixels. Rows are not filtered: masks consist of large areas of one value.
std::string encode_grey_png(const image::Image& image);

}  // namespace bslam::image_files
