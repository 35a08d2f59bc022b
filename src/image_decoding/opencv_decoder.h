// Image files in memory as matrices of OpenCV.
#pragma once

#include <opencv2/core/mat.hpp>
#include <string_view>

namespace bslam::image_decoding {

// Decodes to one channel of 8 or, for 16-bit images, 16 bits. The result is empty if the bytes cannot be decoded.
// Orientation tags are ignored.
cv::Mat decode_to_grey(std::string_view bytes);

}  // namespace bslam::image_decoding
