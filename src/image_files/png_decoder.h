// A fast decoder for 8-bit grey PNGs without interlacing (ISO/IEC 15948).
#pragma once

#include <optional>
#include <string_view>

#include "image/image.h"

namespace bslam::image_files {

inline constexpr std::string_view kPngSignature = "\x89PNG\r\n\x1a\n";

// Returns true if the bytes are a PNG whose chunks are complete up to IEND and have correct checksums.
bool is_complete_png(std::string_view bytes);

// Decodes an 8-bit grey PNG without interlacing at about twice the speed of libpng. `bytes` must have passed
// is_complete_png. Returns nullopt for other kinds of PNG, sides above 20,000 px, and damaged data.
std::optional<image::Image> decode_grey_png(std::string_view bytes);

}  // namespace bslam::image_files
