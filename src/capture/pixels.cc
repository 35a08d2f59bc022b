#include "capture/pixels.h"

#include <algorithm>
#include <array>

#include "image_decoding/image_file.h"

namespace bslam::capture {
namespace {

using image_files::PixelLayout;

constexpr std::array kFormats{fourcc("GREY"), fourcc("Y16 "), fourcc("NV12"), fourcc("YUYV"),
                              fourcc("UYVY"), fourcc("MJPG"), fourcc("JPEG")};

// NV12 begins with the brightness of all pixels.
PixelLayout layout_of(FourCc pixels) {
  if (is_jpeg(pixels)) return PixelLayout::kFile;
  if (pixels == fourcc("YUYV")) return PixelLayout::kYuyv;
  return pixels == fourcc("UYVY") ? PixelLayout::kUyvy : PixelLayout::kGrey;
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

std::span<const FourCc> pixel_formats() { return kFormats; }

bool is_jpeg(FourCc pixels) { return pixels == fourcc("MJPG") || pixels == fourcc("JPEG"); }

std::optional<image::Image> grey_image(const Stream& stream, std::string_view bytes) {
  image_files::StoredImage stored{.bytes = std::string(bytes),
                                  .size = bytes.size(),
                                  .layout = layout_of(stream.pixels),
                                  .width = stream.width,
                                  .height = stream.height,
                                  .step = stream.step};
  if (stream.pixels == fourcc("Y16 ")) stored.bytes_per_value = 2;
  auto image = image_decoding::decode_stored(stored);
  if (!image || image->width() != stream.width || image->height() != stream.height) return std::nullopt;
  return image;
}

}  // namespace bslam::capture
