#include "image_files/png_decoder.h"

#include <libdeflate.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include "base/max_image_side.h"

namespace bslam::image_files {
namespace {

constexpr std::size_t kChunkFrame = 12;  // bytes of length, type and checksum around the data of a chunk

std::uint32_t big_endian(const char* p) {
  const auto byte = [&](int i) { return static_cast<std::uint32_t>(static_cast<unsigned char>(p[i])); };
  return byte(0) << 24 | byte(1) << 16 | byte(2) << 8 | byte(3);
}

struct Chunk {
  std::string_view type, data;
  std::uint32_t checksum = 0;  // CRC-32 over type and data, as stored
};

// Removes the next chunk from `rest` and returns it, or nullopt if it is truncated.
std::optional<Chunk> next_chunk(std::string_view& rest) {
  if (rest.size() < kChunkFrame) return std::nullopt;
  const std::size_t length = big_endian(rest.data());
  if (length > rest.size() - kChunkFrame) return std::nullopt;
  const Chunk chunk{rest.substr(4, 4), rest.substr(8, length), big_endian(rest.data() + 8 + length)};
  rest.remove_prefix(kChunkFrame + length);
  return chunk;
}

bool checksum_holds(const Chunk& chunk) {
  return libdeflate_crc32(0, chunk.type.data(), chunk.type.size() + chunk.data.size()) == chunk.checksum;
}

struct Header {
  int width = 0, height = 0;
};

// Returns nullopt unless the image is 8-bit grey without interlacing, with sides from 1 to kMaxImageSidePx.
std::optional<Header> read_header(const Chunk& chunk) {
  if (chunk.type != "IHDR" || chunk.data.size() != 13) return std::nullopt;
  const std::uint32_t width = big_endian(chunk.data.data()), height = big_endian(chunk.data.data() + 4);
  constexpr std::string_view kPlainGrey("\x08\x00\x00\x00\x00", 5);  // depth, colour, compression, filter, interlacing
  if (width == 0 || height == 0 || width > kMaxImageSidePx || height > kMaxImageSidePx) return std::nullopt;
  if (chunk.data.substr(8) != kPlainGrey) return std::nullopt;
  return Header{static_cast<int>(width), static_cast<int>(height)};
}

// Returns the compressed stream, which is the concatenated data of all IDAT chunks.
std::string join_data(std::string_view chunks) {
  std::string joined;
  joined.reserve(chunks.size());
  while (const auto chunk = next_chunk(chunks)) {
    if (chunk->type == "IDAT") joined += chunk->data;
  }
  return joined;
}

// The Paeth predictor: of left, above and corner (above-left), in this order, the value closest to left + above -
// corner.
int paeth(int left, int above, int corner) {
  const int a = above - corner, b = left - corner;
  const int to_left = std::abs(a), to_above = std::abs(b), to_corner = std::abs(a + b);
  const int best = to_above < to_left ? above : left;
  const int least = to_above < to_left ? to_above : to_left;
  return to_corner < least ? corner : best;
}

// Reverses the filter of one row (ISO/IEC 15948, section 9.2). `above` is the previous row, or zeros for the first row.
bool unfilter(int filter, const std::uint8_t* in, const std::uint8_t* above, std::uint8_t* out, int width) {
  int left = 0, corner = 0;
  switch (filter) {
    case 0:
      std::memcpy(out, in, static_cast<std::size_t>(width));
      return true;
    case 1:
      for (int x = 0; x < width; ++x) out[x] = static_cast<std::uint8_t>(left = (left + in[x]) & 255);
      return true;
    case 2:
      for (int x = 0; x < width; ++x) out[x] = static_cast<std::uint8_t>(in[x] + above[x]);
      return true;
    case 3:
      for (int x = 0; x < width; ++x) {
        out[x] = static_cast<std::uint8_t>(left = (in[x] + ((left + above[x]) >> 1)) & 255);
      }
      return true;
    case 4:
      for (int x = 0; x < width; ++x) {
        left = (in[x] + paeth(left, above[x], corner)) & 255;
        corner = above[x];
        out[x] = static_cast<std::uint8_t>(left);
      }
      return true;
    default:
      return false;
  }
}

}  // namespace

bool is_complete_png(std::string_view bytes) {
  if (!bytes.starts_with(kPngSignature)) return false;
  bytes.remove_prefix(kPngSignature.size());
  while (const auto chunk = next_chunk(bytes)) {
    if (!checksum_holds(*chunk)) return false;
    if (chunk->type == "IEND") return true;
  }
  return false;
}

std::optional<image::Image> decode_grey_png(std::string_view bytes) {
  bytes.remove_prefix(kPngSignature.size());
  const auto first = next_chunk(bytes);
  const auto header = first ? read_header(*first) : std::nullopt;
  if (!header) return std::nullopt;
  const std::string compressed = join_data(bytes);
  const auto width = static_cast<std::size_t>(header->width), height = static_cast<std::size_t>(header->height);
  const std::size_t size = (width + 1) * height;  // every row begins with a filter byte
  const auto filtered = std::make_unique_for_overwrite<std::uint8_t[]>(size);
  const std::unique_ptr<libdeflate_decompressor, void (*)(libdeflate_decompressor*)> decompressor(
      libdeflate_alloc_decompressor(), libdeflate_free_decompressor);
  if (!decompressor || libdeflate_zlib_decompress(decompressor.get(), compressed.data(), compressed.size(),
                                                  filtered.get(), size, nullptr) != LIBDEFLATE_SUCCESS) {
    return std::nullopt;
  }
  image::Image image(header->width, header->height);
  const std::vector<std::uint8_t> zeros(width, 0);
  const std::uint8_t* above = zeros.data();
  for (std::size_t y = 0; y < height; ++y) {
    const std::uint8_t* in = filtered.get() + y * (width + 1);
    std::uint8_t* out = image.row(static_cast<int>(y));
    if (!unfilter(in[0], in + 1, above, out, header->width)) return std::nullopt;
    above = out;
  }
  return image;
}

}  // namespace bslam::image_files
