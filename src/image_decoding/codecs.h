// PNG, JPEG and WebP files in memory as matrices of grey values, decoded by the libraries of these formats, and plain
// formats (image_decoding/plain_files.h).
#pragma once

#include <opencv2/core/mat.hpp>
#include <string_view>

#include "image_decoding/plain_files.h"

namespace bslam::image_decoding {

// Decodes to one channel of 8 or, for files with 16 bits, 16 bits. Transparency and orientation tags are ignored. The
// result is empty if the bytes cannot be decoded.
cv::Mat decode_to_grey(std::string_view bytes, OfColours kept = OfColours::kLuminance);

// Returns true if a file that can be decoded has colours rather than one channel.
bool has_colours(std::string_view bytes);

}  // namespace bslam::image_decoding
