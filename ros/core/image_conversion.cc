#include "core/image_conversion.h"

#include <algorithm>
#include <array>
#include <string_view>
#include <vector>

namespace bslam_ros {
namespace {

using Row = const std::uint8_t*;

enum class Layout { kGrey, kGrey16, kRgb, kBgr, kBayer, kBayer16, kLumaFirst, kLumaSecond };

struct Encoding {
  std::string_view name;
  Layout layout;
  std::size_t bytes;  // per pixel
};

constexpr std::array<Encoding, 24> kEncodings = {{
    {"mono8", Layout::kGrey, 1},
    {"8UC1", Layout::kGrey, 1},
    {"mono16", Layout::kGrey16, 2},
    {"16UC1", Layout::kGrey16, 2},
    {"rgb8", Layout::kRgb, 3},
    {"bgr8", Layout::kBgr, 3},
    {"8UC3", Layout::kBgr, 3},
    {"rgba8", Layout::kRgb, 4},
    {"bgra8", Layout::kBgr, 4},
    {"8UC4", Layout::kBgr, 4},
    {"bayer_rggb8", Layout::kBayer, 1},
    {"bayer_bggr8", Layout::kBayer, 1},
    {"bayer_gbrg8", Layout::kBayer, 1},
    {"bayer_grbg8", Layout::kBayer, 1},
    {"bayer_rggb16", Layout::kBayer16, 2},
    {"bayer_bggr16", Layout::kBayer16, 2},
    {"bayer_gbrg16", Layout::kBayer16, 2},
    {"bayer_grbg16", Layout::kBayer16, 2},
    {"yuv422", Layout::kLumaSecond, 2},
    {"uyvy", Layout::kLumaSecond, 2},
    {"yuv422_yuy2", Layout::kLumaFirst, 2},
    {"yuyv", Layout::kLumaFirst, 2},
    {"nv21", Layout::kGrey, 1},
    {"nv24", Layout::kGrey, 1},
}};

const Encoding* find(std::string_view name) {
  const auto* found =
      std::find_if(kEncodings.begin(), kEncodings.end(), [&](const Encoding& e) { return e.name == name; });
  return found == kEncodings.end() ? nullptr : found;
}

std::uint8_t luma(int r, int g, int b) {
  return static_cast<std::uint8_t>((r * 4899 + g * 9617 + b * 1868 + 8192) >> 14);
}

int read16(Row p, bool big_endian) { return big_endian ? p[0] << 8 | p[1] : p[1] << 8 | p[0]; }

std::uint8_t upper8(int value, int significant_bits) {
  return static_cast<std::uint8_t>(std::min(value >> (significant_bits - 8), 255));
}

std::uint8_t grey_at(const Encoding& encoding, Row row, std::size_t x, bool big_endian, int significant_bits) {
  const Row p = row + x * encoding.bytes;
  switch (encoding.layout) {
    case Layout::kGrey16:
    case Layout::kBayer16:
      return upper8(read16(p, big_endian), significant_bits);
    case Layout::kRgb:
      return luma(p[0], p[1], p[2]);
    case Layout::kBgr:
      return luma(p[2], p[1], p[0]);
    case Layout::kLumaSecond:
      return p[1];
    default:
      return p[0];
  }
}

// (1 2 1)^T (1 2 1) / 16, mirrored at the borders so that the colours keep their phase.
std::vector<std::uint8_t> binomial(const std::vector<std::uint8_t>& in, std::size_t width, std::size_t height) {
  std::vector<std::uint8_t> out(in.size());
  const auto mirrored = [](std::size_t i, std::size_t n) {
    return std::array<std::size_t, 2>{i > 0 ? i - 1 : std::min<std::size_t>(1, n - 1),
                                      i + 1 < n ? i + 1 : (n > 1 ? n - 2 : 0)};
  };
  for (std::size_t y = 0; y < height; ++y) {
    const std::array<std::size_t, 2> rows = mirrored(y, height);
    const auto column = [&](std::size_t x) {
      return in[rows[0] * width + x] + 2 * in[y * width + x] + in[rows[1] * width + x];
    };
    for (std::size_t x = 0; x < width; ++x) {
      const auto [left, right] = mirrored(x, width);
      out[y * width + x] = static_cast<std::uint8_t>((column(left) + 2 * column(x) + column(right) + 8) >> 4);
    }
  }
  return out;
}

bslam::Status check(const RawImage& image, const Encoding* encoding) {
  constexpr std::size_t kMaxSize = 20000;
  const auto wrong = [](const char* key, std::string found, std::string expected) {
    return bslam::Error{"image", key, std::move(found), std::move(expected)};
  };
  if (encoding == nullptr)
    return wrong("encoding", "'" + image.encoding + "'", "a grey, RGB, Bayer or YUV 4:2:2 encoding, see docs/ros.md");
  if (image.width == 0 || image.height == 0 || image.width > kMaxSize || image.height > kMaxSize)
    return wrong("size", std::to_string(image.width) + "x" + std::to_string(image.height), "1 to 20000 pixels");
  if (image.step < image.width * encoding->bytes || image.step > kMaxSize * 64)
    return wrong("step", std::to_string(image.step),
                 "at least " + std::to_string(image.width * encoding->bytes) + " bytes");
  const std::size_t needed = image.step * (image.height - 1) + image.width * encoding->bytes;
  if (image.data == nullptr || image.size < needed)
    return wrong("data", std::to_string(image.size) + " bytes", "at least " + std::to_string(needed));
  return {};
}

}  // namespace

bslam::Result<bslam::CameraImage> to_grey(const RawImage& image, std::int64_t time_ns, int significant_bits) {
  const Encoding* encoding = find(image.encoding);
  if (const bslam::Status status = check(image, encoding); !status) return status.error();
  bslam::CameraImage out;
  out.width = static_cast<int>(image.width);
  out.height = static_cast<int>(image.height);
  out.time_ns = time_ns;
  if (encoding->layout == Layout::kGrey) {
    out.data = image.data;
    out.stride = static_cast<std::ptrdiff_t>(image.step);
    out.owner = image.owner;
    return out;
  }
  std::vector<std::uint8_t> grey(image.width * image.height);
  for (std::size_t y = 0; y < image.height; ++y) {
    const Row row = image.data + y * image.step;
    for (std::size_t x = 0; x < image.width; ++x)
      grey[y * image.width + x] = grey_at(*encoding, row, x, image.big_endian, significant_bits);
  }
  if (encoding->layout == Layout::kBayer || encoding->layout == Layout::kBayer16)
    grey = binomial(grey, image.width, image.height);
  const auto pixels = std::make_shared<const std::vector<std::uint8_t>>(std::move(grey));
  out.data = pixels->data();
  out.stride = out.width;
  out.owner = pixels;
  return out;
}

}  // namespace bslam_ros
