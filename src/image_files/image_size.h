// The size of an image, read from its header only.
#pragma once

#include <optional>
#include <string_view>

namespace bslam::image_files {

struct ImageSize {
  int width = 0, height = 0;  // pixels
};

// Returns the size of a PNG (ISO/IEC 15948, section 11.2.2) or JPEG (ITU-T T.81, section B.2.2) image. Returns nullopt
// for other formats, for a truncated header, and for a size of 0. The pixels are not read.
std::optional<ImageSize> image_size(std::string_view bytes);

}  // namespace bslam::image_files
