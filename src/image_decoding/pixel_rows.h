// Rows of pixels in recordings as grey images. Internal to this folder.
#pragma once

#include <cstdint>
#include <optional>

#include "image/image.h"
#include "image_decoding/pixel_format.h"
#include "image_files/image_store.h"

namespace bslam::image_decoding {

// Returns the brightness of every pixel as 8 bits, the upper eight of `bits` bits for values of two bytes. Images with
// a colour filter are returned as stored. Returns nullopt if the size is impossible or the rows do not fit into the
// bytes. The layout is not kFile.
std::optional<image::Image> grey_of_rows(const image_files::StoredImage& image, int bits);

// Returns the largest value of an image with values of two bytes; 0 if the rows do not fit into the bytes.
std::uint16_t largest_value(const image_files::StoredImage& image);

// Returns the colour filter of an image of this layout: `chosen`, or that of the layout if none was chosen. Colour
// images have none.
Bayer filter_of(image_files::PixelLayout layout, std::optional<Bayer> chosen);

}  // namespace bslam::image_decoding
