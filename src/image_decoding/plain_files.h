// PNM (PGM, PPM), BMP and TIFF files in memory as matrices of grey values. Internal to this folder.
#pragma once

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string_view>
#include <utility>

namespace bslam::image_decoding {

// Returns true if the bytes begin as a file of one of these formats.
bool is_plain_file(std::string_view bytes);

// What is kept of colours: their luminance, or the largest value of red, green and blue, which is 0 for black only.
enum class OfColours { kLuminance, kLargest };

// Decodes to one channel of 8 or 16 bits: PNM with up to 16 bits (P2, P5, P6), BMP with 8, 24 or 32 bits per pixel
// without compression, and TIFF with 8 or 16 bits per value in strips, without compression or with LZW, Deflate or
// PackBits. Transparency is ignored. The result is empty for other kinds of these formats and
// for files that are incomplete.
cv::Mat decode_plain_file(std::string_view bytes, OfColours kept = OfColours::kLuminance);

// The same for TIFF.
cv::Mat decode_tiff(std::string_view bytes, OfColours kept);

// Width and height in the header of a PNM of the kinds above; nullopt for other files.
std::optional<std::pair<std::uint32_t, std::uint32_t>> size_of_pnm(std::string_view bytes);

// Returns true if the header of a file of these formats says that it has colours.
bool plain_file_has_colours(std::string_view bytes);

// The same for TIFF.
bool tiff_has_colours(std::string_view bytes);

// One channel of an image with 1, 3 (blue, green, red) or 4 channels.
cv::Mat one_channel(const cv::Mat& image, OfColours kept);

constexpr std::uint64_t kMaxPixels = std::uint64_t{1} << 28;  // a header with more is damaged

}  // namespace bslam::image_decoding
