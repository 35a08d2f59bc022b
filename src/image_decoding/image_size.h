// The size of an image file in memory, before its pixels are decoded.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace bslam::image_decoding {

struct ImageSize {
  std::uint32_t width = 0, height = 0;  // pixels
};

// Width and height in the header of a PNG, JPEG, WebP or PNM file, as decode_grey would allocate it; nullopt for other
// formats and for files without a complete header. The rest of the file may be damaged.
std::optional<ImageSize> size_in_header(std::string_view bytes);

}  // namespace bslam::image_decoding
