// The size of an image, from its header alone.
#pragma once

#include <optional>
#include <string_view>

namespace bslam::image_files {

struct ImageSize {
  int width = 0, height = 0;  // pixels
};

// Of a PNG (ISO/IEC 15948, section 11.2.2) or JPEG (ITU-T T.81, section B.2.2). Empty for anything else and for a
// header that is cut off or says 0. The pixels are not looked at.
std::optional<ImageSize> image_size(std::string_view bytes);

}  // namespace bslam::image_files
