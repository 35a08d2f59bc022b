// PNG, JPEG and WebP files of every kind, common PNM, BMP and TIFF files, and rows of pixels in recordings, as 8-bit
// grey images. Files are decoded by libpng, libjpeg-turbo and libwebp, or by our own decoders.
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "camera/rig.h"
#include "image/image.h"
#include "image_decoding/pixel_format.h"
#include "image_files/image_folder.h"

namespace bslam::image_decoding {

// Decodes an image file in memory to grey values. Orientation tags are ignored, colours are converted to
// luminance, the upper eight of `format.bits` bits of 16-bit images are kept, and raw images with a colour filter are
// interpolated. Returns nullopt for other formats, truncated files and wrong checksums, for which decoders would return
// the readable part.
std::optional<image::Image> decode_grey(std::string_view bytes, const PixelFormat& format = {});

// The same from a file. Errors: the file cannot be read or is not a complete image.
Result<image::Image> read_image(const std::filesystem::path& file, const PixelFormat& format = {});

// The same from a file or a recording.
Result<image::Image> read_image(const image_files::ImageFile& image, const PixelFormat& format = {});

// Decodes an image of a recording. The colour filter of its layout, or of a file with one channel, takes precedence
// over that of `format`. Returns nullopt if it is incomplete or damaged.
std::optional<image::Image> decode_stored(const image_files::StoredImage& image, const PixelFormat& format = {});

// Returns the number of bits in use in the 16-bit images of a camera: the smallest of 8, 10, 12, 14 and 16 that holds
// all values of a few readable images spread over the list. Returns nullopt if one of them has 8 bits, since such a
// camera has no common number of bits, and if all that can be read are black.
std::optional<int> bits_in_use(std::span<const image_files::ImageFile> images);

// Reads a mask, which is 0 where the file has the value 0 or the colour black, whatever its number of bits.
// FILE.mcap/NAME is an attachment of an MCAP file. Errors as read_image; no such attachment.
Result<image::Image> read_mask_file(const std::filesystem::path& file);

// Reads the mask of a camera, in which 0 marks pixels to ignore; an empty image if the camera has none. Errors: the
// file cannot be read, differs from the resolution of the camera, or is 0 everywhere.
Result<image::Image> read_mask(const camera::Camera& camera);

// Reads the masks of all cameras of a rig, in order; errors as read_mask.
Result<std::vector<image::Image>> read_masks(const camera::Rig& rig);

}  // namespace bslam::image_decoding
