// PNG and JPEG files of every kind as 8-bit grey images, decoded by OpenCV if our own PNG decoder does not support
// them.
#pragma once

#include <filesystem>
#include <optional>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "camera/rig.h"
#include "image/image.h"

namespace bslam::image_decoding {

// Decodes a PNG or JPEG in memory to grey values. Orientation tags are ignored, colours are converted to luminance, and
// the upper eight of 16 bits are kept. Returns nullopt for other formats, truncated files and wrong checksums, for
// which decoders would return the readable part.
std::optional<image::Image> decode_grey(std::string_view bytes);

// The same from a file. Errors: the file cannot be read or is not a complete image.
Result<image::Image> read_image(const std::filesystem::path& file);

// Reads the mask of a camera, in which 0 marks pixels to ignore; an empty image if the camera has none. Errors: the
// file cannot be read, differs from the resolution of the camera, or is 0 everywhere.
Result<image::Image> read_mask(const camera::Camera& camera);

// Reads the masks of all cameras of a rig, in order; errors as read_mask.
Result<std::vector<image::Image>> read_masks(const camera::Rig& rig);

}  // namespace bslam::image_decoding
