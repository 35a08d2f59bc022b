// PNG and JPEG files as 8-bit images with colours, and writing of PNG files.
#pragma once

#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <string>

#include "base/result.h"
#include "image_decoding/pixel_format.h"

namespace bslam::image_decoding {

// Reads an image as red, green, blue (CV_8UC3). Orientation tags and transparency are ignored. 16-bit and raw images
// are read as by read_image, so that their colours are equal. Errors: the file cannot be read or is not a complete
// image.
Result<cv::Mat> read_colours(const std::filesystem::path& file, const PixelFormat& format = {});

// Returns a PNG file of an image with one channel or with red, green and blue, 8 bits each.
std::string encode_png(const cv::Mat& image);

}  // namespace bslam::image_decoding
