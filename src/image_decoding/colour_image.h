// PNG and JPEG files as 8-bit images with colours, and writing of PNG files.
#pragma once

#include <opencv2/core/mat.hpp>
#include <string>

#include "base/result.h"
#include "image_decoding/pixel_format.h"
#include "image_files/image_folder.h"

namespace bslam::image_decoding {

// Reads an image as red, green, blue (CV_8UC3). Orientation tags and transparency are ignored. Images of 16 bits, with
// a colour filter, or with subsampled colours are read as by read_image, so that their three channels are equal.
// Errors: as read_image.
Result<cv::Mat> read_colours(const image_files::ImageFile& image, const PixelFormat& format = {});

// Returns a PNG file of an image with one channel or with red, green and blue, 8 bits each.
std::string encode_png(const cv::Mat& image);

// The colour at a position of an image of CV_8UC3, interpolated between its pixels. Positions outside of the image are
// moved to its border.
cv::Vec3f colour_at(const cv::Mat& image, float x, float y);

}  // namespace bslam::image_decoding
