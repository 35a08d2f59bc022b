// PNG (ISO/IEC 15948) where decoding is in the hot path. Internal to io.
#pragma once

#include <optional>
#include <string_view>

#include "image/image.h"

namespace bslam::image_files {

// True for a PNG whose chunks are complete up to IEND and, where libdeflate is built in, have the right checksums.
bool is_whole_png(std::string_view bytes);

// Pixels of an 8-bit grey PNG without interlacing, the common kind, at about twice the speed of libpng. `bytes` passed
// is_whole_png. Empty for other kinds, for damaged data, and where libdeflate is not built in: the general decoder has
// the word then.
std::optional<image::Image> decode_grey_png(std::string_view bytes);

}  // namespace bslam::image_files
