// PNG and JPEG files of every kind as 8-bit grey images, by OpenCV where our own PNG decoder does not read them.
#pragma once

#include <filesystem>
#include <optional>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "camera/rig.h"
#include "image/image.h"

namespace bslam::image_decoding {

// Grey pixels of a PNG or JPEG in memory, as stored: a rotation noted in the file is not applied. Colours are weighted
// to luminance; of 16 bits the upper eight are kept. Empty for anything else and for files that end early or whose
// checksums are wrong: decoders would hand out the part they could read.
std::optional<image::Image> decode_grey(std::string_view bytes);

// The same from a file. Errors: not readable, no whole image.
Result<image::Image> read_image(const std::filesystem::path& file);

// The mask of a camera, 0 = ignore; an empty image where it has none. Errors: not readable, not the camera's
// resolution, 0 everywhere.
Result<image::Image> read_mask(const camera::Camera& camera);

// The masks of all cameras of a rig, in order; errors as read_mask.
Result<std::vector<image::Image>> read_masks(const camera::Rig& rig);

}  // namespace bslam::image_decoding
