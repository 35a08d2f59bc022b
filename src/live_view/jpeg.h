// Images as small JPEG files, for browsers.
#pragma once

#include <string>

#include "image/image.h"

namespace bslam::live_view {

// Encodes an image, reduced to a width of at most `max_width` pixels. Empty if the image is empty or cannot be encoded.
std::string small_jpeg(const image::ImageView& image, int max_width);

}  // namespace bslam::live_view
