// How the values in an image file represent brightness.
#pragma once

#include <optional>

namespace bslam::image_decoding {

// The colour filter of a raw image, named by the first two pixels of its first and second row.
enum class Bayer { kNone, kRggb, kBggr, kGrbg, kGbrg };

// The same for all images of a camera, so that brightness does not change between them.
struct PixelFormat {
  int bits = 16;  // bits in use in 16-bit files: 2^bits - 1 is white; larger values are clamped to it
  // Colour filter of images with one channel, also of those of which a recording names another; nullopt: the one that
  // the recording names, if any.
  std::optional<Bayer> bayer = {};
};

}  // namespace bslam::image_decoding
