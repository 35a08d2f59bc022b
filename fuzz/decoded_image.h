// The check of what an image decoder returns, for any input.
#pragma once

#include "image_decoding/image_file.h"
#include "target.h"

namespace bslam::fuzz {

// Decodes the bytes and reads all pixels of the image, if there is one.
inline void check_decoded_image(std::string_view bytes) {
  const auto image = image_decoding::decode_grey(bytes);
  if (!image) return;
  require(image->width() > 0 && image->height() > 0, "an image must have pixels");
  unsigned sum = 0;
  for (int y = 0; y < image->height(); ++y) {
    for (int x = 0; x < image->width(); ++x) sum += image->row(y)[x];
  }
  require(sum <= 255u * static_cast<unsigned>(image->width()) * static_cast<unsigned>(image->height()),
          "grey values must be at most 255");
}

}  // namespace bslam::fuzz
