#include "image_decoding/image_file.h"

#include <algorithm>
#include <cstdint>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <system_error>
#include <utility>

#include "base/atomic_file.h"
#include "containers/message_file.h"
#include "image_decoding/codecs.h"
#include "image_decoding/pixel_rows.h"
#include "image_decoding/plain_files.h"
#include "image_files/mask.h"
#include "image_files/png_decoder.h"

namespace bslam::image_decoding {
namespace {

constexpr std::size_t kMaxImageBytes = std::size_t{1} << 30;

// Returns true if the end-of-image marker follows the segments and the image data of a JPEG, from which it differs by
// the lengths of the former and the zeros after each 0xff in the latter.
bool reaches_its_end(std::string_view bytes) {
  constexpr unsigned char kEnd = 0xd9, kFirstRestart = 0xd0, kFill = 0xff;
  const auto byte = [&](std::size_t at) { return static_cast<unsigned char>(bytes[at]); };
  std::size_t at = 2;  // after the marker of the start
  while ((at = bytes.find('\xff', at)) != std::string_view::npos && at + 1 < bytes.size()) {
    const unsigned char marker = byte(at + 1);
    if (marker == kEnd) return true;
    at += marker == kFill ? 1 : 2;
    const bool in_data = marker <= 1 || marker == kFill || (marker >= kFirstRestart && marker < kEnd);
    if (in_data || at + 2 > bytes.size()) continue;
    at += std::size_t{byte(at)} << 8 | byte(at + 1);
  }
  return false;
}

// Returns true if the bytes start as a JPEG and contain all of it. Cameras and recorders may add others, such as zeros,
// the rest of a buffer, or a video.
bool is_whole_jpeg(std::string_view bytes) {
  if (!bytes.starts_with("\xff\xd8\xff")) return false;
  const std::size_t last = bytes.find_last_not_of('\0');
  return bytes.substr(0, last + 1).ends_with("\xff\xd9") || reaches_its_end(bytes);
}

// Returns the upper eight of `bits` bits; larger values are white.
void copy_row(const std::uint16_t* in, int bits, int width, std::uint8_t* out) {
  const int shift = bits - 8;
  std::transform(in, in + width, out,
                 [shift](std::uint16_t v) { return static_cast<std::uint8_t>(std::min(v >> shift, 255)); });
}

std::optional<image::Image> decode_with_library(std::string_view bytes, int bits, OfColours kept) {
  const cv::Mat decoded = decode_to_grey(bytes, kept);
  if (decoded.empty() || (decoded.depth() != CV_8U && decoded.depth() != CV_16U)) return std::nullopt;
  image::Image image(decoded.cols, decoded.rows);
  for (int y = 0; y < decoded.rows; ++y) {
    if (decoded.depth() == CV_16U) {
      copy_row(decoded.ptr<std::uint16_t>(y), bits, decoded.cols, image.row(y));
    } else {
      std::copy_n(decoded.ptr<std::uint8_t>(y), decoded.cols, image.row(y));
    }
  }
  return image;
}

// OpenCV names a pattern by the second and third pixel of the second row: its BG is RGGB.
int bayer_conversion(Bayer bayer) {
  if (bayer == Bayer::kRggb) return cv::COLOR_BayerBG2GRAY;
  if (bayer == Bayer::kBggr) return cv::COLOR_BayerRG2GRAY;
  return bayer == Bayer::kGrbg ? cv::COLOR_BayerGB2GRAY : cv::COLOR_BayerGR2GRAY;
}

// Interpolates the missing colours of every pixel and returns the luminance.
image::Image without_colour_filter(image::Image raw, Bayer bayer) {
  if (raw.width() < 4 || raw.height() < 4) return raw;
  image::Image grey(raw.width(), raw.height());
  cv::Mat in(raw.height(), raw.width(), CV_8UC1), out;
  for (int y = 0; y < raw.height(); ++y) std::copy_n(raw.row(y), raw.width(), in.ptr<std::uint8_t>(y));
  cv::cvtColor(in, out, bayer_conversion(bayer));
  for (int y = 0; y < raw.height(); ++y) std::copy_n(out.ptr<std::uint8_t>(y), raw.width(), grey.row(y));
  return grey;
}

// WebP files state their size.
bool is_whole_webp(std::string_view bytes) {
  constexpr std::size_t kFrame = 8;  // bytes before what is counted
  if (bytes.size() < 12 || !bytes.starts_with("RIFF") || bytes.substr(8, 4) != "WEBP") return false;
  std::uint64_t size = 0;
  for (std::size_t k = 0; k < 4; ++k) size |= std::uint64_t{static_cast<unsigned char>(bytes[4 + k])} << 8 * k;
  return size + kFrame <= bytes.size();
}

bool is_16_bit_png(std::string_view bytes) {
  constexpr std::size_t kBitDepth = 24;  // position of the bit depth in a PNG
  return image_files::is_complete_png(bytes) && bytes[kBitDepth] == 16;
}

std::optional<image::Image> decode_values(std::string_view bytes, int bits, OfColours kept = OfColours::kLuminance) {
  if (bytes.size() > kMaxImageBytes) return std::nullopt;
  if (image_files::is_complete_png(bytes)) {
    auto image = image_files::decode_grey_png(bytes);
    return image ? std::move(image) : decode_with_library(bytes, bits, kept);
  }
  const bool whole = is_whole_jpeg(bytes) || is_whole_webp(bytes) || is_plain_file(bytes);
  return whole ? decode_with_library(bytes, bits, kept) : std::nullopt;
}

// The bytes of an image in memory. Errors as of the file or the recording.
Result<image_files::StoredImage> read_stored(const image_files::ImageFile& image) {
  if (image.store) return image.store->read(image.entry);
  auto bytes = read_file(image.path, kMaxImageBytes);
  if (!bytes) return bytes.error();
  const std::size_t size = bytes->size();
  return image_files::StoredImage{.bytes = *std::move(bytes), .size = size};
}

// The bytes of a mask, which may be inside of a recording of bslam live.
Result<std::string> mask_bytes(const std::filesystem::path& file) {
  if (const auto recording = image_files::recording_around(file))
    return containers::read_attachment(*recording, file.lexically_relative(*recording).generic_string());
  return read_file(file, kMaxImageBytes);
}

Error not_readable(const std::filesystem::path& file) {
  return {file.string(), "", "an incomplete image or another format",
          "a complete PNG, JPEG, WebP, PGM, BMP or TIFF image"};
}

}  // namespace

std::optional<image::Image> decode_grey(std::string_view bytes, const PixelFormat& format) {
  auto image = decode_values(bytes, format.bits);
  const Bayer filter = format.bayer.value_or(Bayer::kNone);
  if (!image || filter == Bayer::kNone) return image;
  return without_colour_filter(*std::move(image), filter);
}

Result<image::Image> read_image(const std::filesystem::path& file, const PixelFormat& format) {
  const auto bytes = read_file(file, kMaxImageBytes);
  if (!bytes) return bytes.error();
  auto image = decode_grey(*bytes, format);
  if (!image) return not_readable(file);
  return *std::move(image);
}

Result<image::Image> read_image(const image_files::ImageFile& file, const PixelFormat& format) {
  if (!file.store) return read_image(file.path, format);
  const auto stored = file.store->read(file.entry);
  if (!stored) return stored.error();
  auto image = decode_stored(*stored, format);
  if (!image)
    return Error{file.store->name(file.entry), "", "an incomplete image or another format", "a complete image"};
  return *std::move(image);
}

std::optional<image::Image> decode_stored(const image_files::StoredImage& stored, const PixelFormat& format) {
  if (stored.begin > stored.bytes.size() || stored.size > stored.bytes.size() - stored.begin) return std::nullopt;
  if (stored.layout == image_files::PixelLayout::kFile) {
    const std::string_view file = std::string_view(stored.bytes).substr(stored.begin, stored.size);
    PixelFormat of_file = format;
    if (stored.filter != image_files::PixelLayout::kFile && !has_colours(file))
      of_file.bayer = filter_of(stored.filter, format.bayer);
    return decode_grey(file, of_file);
  }
  auto image = grey_of_rows(stored, format.bits);
  const Bayer filter = filter_of(stored.layout, format.bayer);
  if (!image || filter == Bayer::kNone) return image;
  return without_colour_filter(*std::move(image), filter);
}

std::optional<int> bits_in_use(std::span<const image_files::ImageFile> images) {
  constexpr std::size_t kSamples = 12;
  const std::size_t count = std::min(kSamples, images.size());
  double largest = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const auto stored = read_stored(images[k * images.size() / count]);
    if (!stored) continue;
    if (stored->layout != image_files::PixelLayout::kFile) {
      if (stored->bytes_per_value != 2) return std::nullopt;
      largest = std::max(largest, static_cast<double>(largest_value(*stored)));
      continue;
    }
    const std::string_view bytes = stored->bytes;
    const std::string_view file = bytes.substr(std::min(stored->begin, bytes.size()), stored->size);
    const bool png = image_files::is_complete_png(file);
    if (is_whole_jpeg(file) || is_whole_webp(file) || (png && !is_16_bit_png(file))) return std::nullopt;
    if (!png && !is_plain_file(file)) continue;
    const cv::Mat decoded = decode_to_grey(file);
    if (!decoded.empty() && decoded.depth() == CV_8U) return std::nullopt;
    double value = 0;
    if (!decoded.empty()) cv::minMaxLoc(decoded, nullptr, &value);
    largest = std::max(largest, value);
  }
  if (largest <= 0) return std::nullopt;
  for (const int bits : {8, 10, 12, 14}) {
    if (largest < static_cast<double>(1 << bits)) return bits;
  }
  return 16;
}

Result<image::Image> read_mask_file(const std::filesystem::path& file) {
  constexpr int kBits = 8;  // larger values are clamped, so that labels below 256 are kept
  const auto bytes = mask_bytes(file);
  if (!bytes) return bytes.error();
  auto mask = decode_values(*bytes, kBits, OfColours::kLargest);
  if (!mask) return not_readable(file);
  return *std::move(mask);
}

Result<image::Image> read_mask(const camera::Camera& camera) {
  if (camera.mask_file.empty()) return image::Image();
  auto mask = read_mask_file(camera.mask_file);
  if (!mask) return mask;
  return image_files::checked_mask(*std::move(mask), camera);
}

Result<std::vector<image::Image>> read_masks(const camera::Rig& rig) {
  std::vector<image::Image> masks;
  for (std::size_t c = 0; c < rig.size(); ++c) {
    auto mask = read_mask(rig.camera(c));
    if (!mask) return mask.error();
    masks.push_back(std::move(*mask));
  }
  return masks;
}

}  // namespace bslam::image_decoding
