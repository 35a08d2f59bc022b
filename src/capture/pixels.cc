#include "capture/pixels.h"

#include <algorithm>
#include <array>

#include "image_decoding/image_file.h"

namespace bslam::capture {
namespace {

using image_files::PixelLayout;

struct Format {
  FourCc pixels;
  PixelLayout layout;
  int bytes_per_pixel = 1;  // 0: whole files
  int bits = 8;             // number of bits in use, for values of two bytes
};

// NV12 begins with the brightness of all pixels.
constexpr std::array kFormats{
    Format{fourcc("GREY"), PixelLayout::kGrey},        Format{fourcc("Y16 "), PixelLayout::kGrey, 2, 16},
    Format{fourcc("Y12 "), PixelLayout::kGrey, 2, 12}, Format{fourcc("Y10 "), PixelLayout::kGrey, 2, 10},
    Format{fourcc("NV12"), PixelLayout::kGrey},        Format{fourcc("YUYV"), PixelLayout::kYuyv, 2},
    Format{fourcc("UYVY"), PixelLayout::kUyvy, 2},     Format{fourcc("RGB3"), PixelLayout::kRgb, 3},
    Format{fourcc("BGR3"), PixelLayout::kBgr, 3},      Format{fourcc("RGGB"), PixelLayout::kRggb},
    Format{fourcc("GRBG"), PixelLayout::kGrbg},        Format{fourcc("GBRG"), PixelLayout::kGbrg},
    Format{fourcc("BA81"), PixelLayout::kBggr},        Format{fourcc("MJPG"), PixelLayout::kFile, 0},
    Format{fourcc("JPEG"), PixelLayout::kFile, 0}};

constexpr auto kNames = [] {
  std::array<FourCc, kFormats.size()> out{};
  std::ranges::transform(kFormats, out.begin(), &Format::pixels);
  return out;
}();

const Format* find_format(FourCc pixels) {
  const auto found = std::ranges::find(kFormats, pixels, &Format::pixels);
  return found == kFormats.end() ? nullptr : &*found;
}

}  // namespace

std::string fourcc_text(FourCc pixels) {
  std::string out;
  for (int k = 0; k < 4; ++k) {
    const auto c = static_cast<char>(pixels >> 8 * k & 0x7f);
    out += c < ' ' ? '?' : c;
  }
  return out.substr(0, out.find_last_not_of(' ') + 1);
}

std::span<const FourCc> pixel_formats() { return kNames; }

int bytes_per_pixel(FourCc pixels) {
  const Format* format = find_format(pixels);
  return format == nullptr ? 0 : format->bytes_per_pixel;
}

bool is_jpeg(FourCc pixels) { return pixels == fourcc("MJPG") || pixels == fourcc("JPEG"); }

std::optional<image::Image> grey_image(const Stream& stream, std::string_view bytes) {
  const Format* format = find_format(stream.pixels);
  if (format == nullptr) return std::nullopt;
  image_files::StoredImage stored{.bytes = std::string(bytes),
                                  .size = bytes.size(),
                                  .layout = format->layout,
                                  .width = stream.width,
                                  .height = stream.height,
                                  .step = stream.step,
                                  .bytes_per_value = format->bits > 8 ? 2 : 1};
  auto image = image_decoding::decode_stored(stored, {.bits = format->bits});
  if (!image || image->width() != stream.width || image->height() != stream.height) return std::nullopt;
  return image;
}

}  // namespace bslam::capture
