// TIFF 6.0 (Adobe, 1992): images in strips of rows, with the compressions that cameras and libraries write. libtiff is
// not used: as distributed it needs libjbig, which has a GPL licence.
#include <libdeflate.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <memory>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <string>
#include <vector>

#include "image_decoding/plain_files.h"

namespace bslam::image_decoding {
namespace {

constexpr std::size_t kMostBytes = std::size_t{1} << 29;  // maximum size of an image
// Maximum compression ratio of all supported compressions; a header that requires more is damaged.
constexpr std::size_t kMostRatio = 3000;
constexpr std::uint32_t kNone = 1, kLzw = 5, kDeflate = 8, kPackBits = 32773, kOldDeflate = 32946;

// Reads numbers in the byte order of the file. Outside of the file they are 0.
struct TiffBytes {
  std::string_view bytes;
  bool big_endian = false;

  std::uint32_t number(std::size_t at, std::size_t count) const {
    if (at > bytes.size() || bytes.size() - at < count) return 0;
    std::uint32_t value = 0;
    for (std::size_t k = 0; k < count; ++k) {
      const std::size_t from = at + (big_endian ? k : count - 1 - k);
      value = value << 8 | static_cast<unsigned char>(bytes[from]);
    }
    return value;
  }
};

// The fields of the first image of a file; those with one value are numbers.
struct TiffImage {
  std::uint32_t width = 0, height = 0, bits = 1, compression = kNone, photometric = 1, samples = 1;
  std::uint32_t rows_per_strip = 0xffffffff, planes = 1, predictor = 1, sample_format = 1;
  std::vector<std::uint32_t> offsets, sizes;
  bool equal_bits = true;
};

std::vector<std::uint32_t> values_of(const TiffBytes& in, std::size_t entry) {
  const std::uint32_t type = in.number(entry + 2, 2), count = in.number(entry + 4, 4);
  const std::size_t size = type == 3 ? 2 : type == 4 ? 4 : type == 1 ? 1 : 0;  // SHORT, LONG, BYTE
  if (size == 0 || count > in.bytes.size()) return {};
  const std::size_t at = size * count <= 4 ? entry + 8 : in.number(entry + 8, 4);
  std::vector<std::uint32_t> values;
  for (std::size_t k = 0; k < count; ++k) values.push_back(in.number(at + size * k, size));
  return values;
}

void set_field(TiffImage& image, std::uint32_t tag, std::vector<std::uint32_t> values) {
  if (values.empty()) return;
  const std::uint32_t value = values.front();
  switch (tag) {
    case 256:
      image.width = value;
      break;
    case 257:
      image.height = value;
      break;
    case 258:
      image.bits = value;
      image.equal_bits = std::ranges::all_of(values, [value](std::uint32_t v) { return v == value; });
      break;
    case 259:
      image.compression = value;
      break;
    case 262:
      image.photometric = value;
      break;
    case 273:
      image.offsets = std::move(values);
      break;
    case 277:
      image.samples = value;
      break;
    case 278:
      image.rows_per_strip = value;
      break;
    case 279:
      image.sizes = std::move(values);
      break;
    case 284:
      image.planes = value;
      break;
    case 317:
      image.predictor = value;
      break;
    case 339:
      image.sample_format = value;
      break;
    default:
      break;
  }
}

// Returns nullopt for what this decoder does not read, such as tiles, palettes, floating point and separate planes.
std::optional<TiffImage> read_fields(const TiffBytes& in) {
  TiffImage image;
  constexpr std::size_t kMostFields = 256;
  const std::size_t directory = in.number(4, 4), count = std::min<std::size_t>(in.number(directory, 2), kMostFields);
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t entry = directory + 2 + 12 * k;
    set_field(image, in.number(entry, 2), values_of(in, entry));
  }
  constexpr std::uint32_t kSide = 1 << 20;
  const bool grey = image.photometric <= 1 && (image.samples == 1 || image.samples == 2);
  const bool colour = image.photometric == 2 && (image.samples == 3 || image.samples == 4);
  const bool known = (grey || colour) && image.equal_bits && (image.bits == 8 || image.bits == 16) &&
                     image.planes == 1 && image.sample_format == 1 && (image.predictor == 1 || image.predictor == 2);
  if (!known || image.width < 1 || image.height < 1 || image.width > kSide || image.height > kSide) return std::nullopt;
  const std::uint64_t size = std::uint64_t{image.width} * image.height * image.samples * (image.bits / 8);
  if (size > kMostBytes || size / kMostRatio > in.bytes.size()) return std::nullopt;
  image.rows_per_strip = std::clamp(image.rows_per_strip, 1U, image.height);
  const std::size_t strips = (image.height + image.rows_per_strip - 1) / image.rows_per_strip;
  return image.offsets.size() == strips && image.sizes.size() == strips ? std::optional(std::move(image))
                                                                        : std::nullopt;
}

// A count of literal bytes, or of repetitions of one byte, before each run.
std::string unpack_bits(std::string_view in, std::size_t size) {
  std::string out;
  for (std::size_t at = 0; at + 1 < in.size() && out.size() < size;) {
    const auto count = static_cast<signed char>(in[at++]);
    if (count >= 0) {
      const std::size_t length = std::min<std::size_t>(static_cast<std::size_t>(count) + 1, in.size() - at);
      out.append(in.substr(at, length));
      at += length;
    } else if (count != -128) {
      out.append(static_cast<std::size_t>(1 - count), in[at++]);
    }
  }
  return out;
}

// Codes of 9 to 12 bits, the first bit of a byte first, of which each is a text that occurred before and one more byte.
std::string unpack_lzw(std::string_view in, std::size_t size) {
  constexpr std::size_t kClear = 256, kEnd = 257, kMost = 4096;
  std::vector<std::string> texts(kEnd + 1);
  for (std::size_t k = 0; k < kClear; ++k) texts[k] = std::string(1, static_cast<char>(k));
  std::string out, last;
  std::uint32_t bits = 0;
  int available = 0, width = 9;
  for (const char byte : in) {
    bits = bits << 8 | static_cast<unsigned char>(byte);
    available += 8;
    if (available < width) continue;
    available -= width;
    const std::size_t code = bits >> available & ((1U << width) - 1);
    if (code == kEnd || out.size() >= size) break;
    if (code == kClear) {
      texts.resize(kEnd + 1);
      last.clear();
      width = 9;
      continue;
    }
    if (code > texts.size() || (code == texts.size() && last.empty())) break;  // damaged
    std::string text = code < texts.size() ? texts[code] : last + last.front();
    if (!last.empty() && texts.size() < kMost) texts.push_back(last + text.front());
    out += text;
    last = std::move(text);
    const std::size_t next = texts.size() + 1;  // a code that may come next is one ahead of the table
    width = next >= 2048 ? 12 : next >= 1024 ? 11 : next >= 512 ? 10 : 9;
  }
  return out;
}

std::string unpack_deflate(std::string_view in, std::size_t size) {
  if (size / kMostRatio > in.size()) return {};
  const std::unique_ptr<libdeflate_decompressor, void (*)(libdeflate_decompressor*)> decompressor(
      libdeflate_alloc_decompressor(), libdeflate_free_decompressor);
  std::string out(size, '\0');
  std::size_t found = 0;
  if (!decompressor || libdeflate_zlib_decompress(decompressor.get(), in.data(), in.size(), out.data(), size, &found) !=
                           LIBDEFLATE_SUCCESS)
    return {};
  out.resize(found);
  return out;
}

std::string unpacked(std::string_view in, std::uint32_t compression, std::size_t size) {
  if (compression == kNone) return std::string(in.substr(0, size));
  if (compression == kLzw) return unpack_lzw(in, size);
  if (compression == kPackBits) return unpack_bits(in, size);
  return compression == kDeflate || compression == kOldDeflate ? unpack_deflate(in, size) : std::string();
}

// Writes the values of a row in the byte order of this computer, and adds up differences.
template <class T>
void copy_values(const TiffBytes& in, const TiffImage& image, T* out) {
  const std::size_t count = std::size_t{image.width} * image.samples;
  for (std::size_t k = 0; k < count; ++k) out[k] = static_cast<T>(in.number(k * sizeof(T), sizeof(T)));
  if (image.predictor == 1) return;
  for (std::size_t k = image.samples; k < count; ++k) out[k] = static_cast<T>(out[k] + out[k - image.samples]);
}

bool read_strip(const TiffBytes& in, const TiffImage& image, std::size_t strip, cv::Mat& out) {
  const std::uint32_t first = static_cast<std::uint32_t>(strip) * image.rows_per_strip;
  const std::uint32_t rows = std::min(image.rows_per_strip, image.height - first);
  const std::size_t row = std::size_t{image.width} * image.samples * (image.bits / 8);
  const std::size_t at = image.offsets[strip];
  if (at > in.bytes.size() || image.sizes[strip] > in.bytes.size() - at) return false;
  const std::string values = unpacked(in.bytes.substr(at, image.sizes[strip]), image.compression, row * rows);
  if (values.size() < row * rows) return false;
  for (std::uint32_t y = 0; y < rows; ++y) {
    const TiffBytes line{std::string_view(values).substr(row * y, row), in.big_endian};
    const int to = static_cast<int>(first + y);
    if (image.bits == 8) copy_values(line, image, out.ptr<std::uint8_t>(to));
    if (image.bits == 16) copy_values(line, image, out.ptr<std::uint16_t>(to));
  }
  return true;
}

}  // namespace

bool tiff_has_colours(std::string_view bytes) {
  const auto image = read_fields({bytes, bytes.front() == 'M'});
  return image && image->samples >= 3;
}

cv::Mat decode_tiff(std::string_view bytes, OfColours kept) {
  const TiffBytes in{bytes, bytes.front() == 'M'};
  const auto image = read_fields(in);
  if (!image) return {};
  cv::Mat out(static_cast<int>(image->height), static_cast<int>(image->width),
              CV_MAKETYPE(image->bits == 8 ? CV_8U : CV_16U, static_cast<int>(image->samples)));
  for (std::size_t strip = 0; strip < image->offsets.size(); ++strip) {
    if (!read_strip(in, *image, strip, out)) return {};
  }
  if (image->samples == 2) cv::extractChannel(out, out, 0);
  if (image->samples >= 3) cv::cvtColor(out, out, image->samples == 3 ? cv::COLOR_RGB2BGR : cv::COLOR_RGBA2BGRA);
  if (image->photometric == 0) cv::bitwise_not(out, out);
  return one_channel(out, kept);
}

}  // namespace bslam::image_decoding
