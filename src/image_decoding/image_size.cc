#include "image_decoding/image_size.h"

#include <turbojpeg.h>
#include <webp/decode.h>

#include <memory>

#include "image_decoding/plain_files.h"

namespace bslam::image_decoding {
namespace {

const unsigned char* octets(std::string_view bytes) { return reinterpret_cast<const unsigned char*>(bytes.data()); }

std::uint32_t big_endian_at(std::string_view bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t k = 0; k < 4; ++k) value = value << 8 | octets(bytes)[at + k];
  return value;
}

std::optional<ImageSize> size_of_png(std::string_view bytes) {
  constexpr std::size_t kType = 12, kWidth = 16, kHeight = 20, kEnd = 24;
  if (bytes.size() < kEnd || bytes.substr(kType, 4) != "IHDR") return std::nullopt;
  return ImageSize{big_endian_at(bytes, kWidth), big_endian_at(bytes, kHeight)};
}

std::optional<ImageSize> size_of_jpeg(std::string_view bytes) {
  const std::unique_ptr<void, int (*)(tjhandle)> decoder(tjInitDecompress(), tjDestroy);
  int width = 0, height = 0, subsampling = 0, colours = 0;
  if (!decoder ||
      tjDecompressHeader3(decoder.get(), octets(bytes), bytes.size(), &width, &height, &subsampling, &colours) != 0)
    return std::nullopt;
  return ImageSize{static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height)};
}

std::optional<ImageSize> size_of_webp(std::string_view bytes) {
  int width = 0, height = 0;
  if (!WebPGetInfo(octets(bytes), bytes.size(), &width, &height)) return std::nullopt;
  return ImageSize{static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height)};
}

std::optional<ImageSize> size_by_format(std::string_view bytes) {
  if (bytes.starts_with("\x89PNG\r\n\x1a\n")) return size_of_png(bytes);
  if (bytes.starts_with("\xff\xd8")) return size_of_jpeg(bytes);
  if (bytes.starts_with("RIFF")) return size_of_webp(bytes);
  const auto size = size_of_pnm(bytes);
  return size ? std::optional(ImageSize{size->first, size->second}) : std::nullopt;
}

}  // namespace

std::optional<ImageSize> size_in_header(std::string_view bytes) {
  const auto size = size_by_format(bytes);
  return size && size->width > 0 && size->height > 0 ? size : std::nullopt;
}

}  // namespace bslam::image_decoding
