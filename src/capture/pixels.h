// The pixel formats of cameras that can be converted to grey images.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "capture/device.h"
#include "image/image.h"

namespace bslam::capture {

// Returns the number of four characters, such as "GREY".
constexpr FourCc fourcc(const char (&name)[5]) {
  FourCc out = 0;
  for (int k = 3; k >= 0; --k) out = out << 8 | static_cast<unsigned char>(name[k]);
  return out;
}
std::string fourcc_text(FourCc pixels);

// All formats that can be converted, those that need least work first: GREY, Y16, Y12, Y10, NV12, YUYV, UYVY, RGB3,
// BGR3, colour filters of 8 bits (RGGB, GRBG, GBRG, BA81), MJPG, JPEG.
std::span<const FourCc> pixel_formats();

// Bytes of a pixel in the first plane; 0 for whole files and unknown formats.
int bytes_per_pixel(FourCc pixels);

// Returns true if images are whole JPEG files.
bool is_jpeg(FourCc pixels);

// Returns the brightness of an image; nullopt if it is incomplete, damaged or of another size than that of the stream.
std::optional<image::Image> grey_image(const Stream& stream, std::string_view bytes);

}  // namespace bslam::capture
