// Images inside of other files, such as bags and videos, and how their pixels lie in memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "base/result.h"

namespace bslam::image_files {

// kFile: a whole image file, such as PNG, JPEG or WebP. All others are rows of pixels. Colour filters are named by the
// first two pixels of the first and second row; kUyvy and kYuyv have one brightness per pixel, and two colours per two
// pixels.
enum class PixelLayout { kFile, kGrey, kRgb, kBgr, kRgba, kBgra, kRggb, kBggr, kGrbg, kGbrg, kUyvy, kYuyv };

struct StoredImage {
  std::string bytes;  // the image is `size` bytes from `begin`
  std::size_t begin = 0, size = 0;
  PixelLayout layout = PixelLayout::kFile;
  int width = 0, height = 0;                // pixels; 0 for kFile
  std::size_t step = 0;                     // bytes from one row to the next
  int bytes_per_value = 1;                  // 1 or 2
  bool big_endian = false;                  // byte order of values of two bytes
  PixelLayout filter = PixelLayout::kFile;  // colour filter of a file if that has one channel; kFile: none
};

// Reads images by their number in a recording. May be called from several threads at the same time.
class ImageStore {
 public:
  virtual ~ImageStore() = default;

  // Errors, which name the file and the image: it is damaged, or its pixels have an unknown layout.
  virtual Result<StoredImage> read(std::int64_t entry) const = 0;
  // Text for messages: file, topic and number of the image.
  virtual std::string name(std::int64_t entry) const = 0;
  // Text for messages: file and topic.
  virtual std::string source(std::int64_t entry) const = 0;
  // The topic alone, or the video.
  virtual std::string stream(std::int64_t entry) const = 0;
};

}  // namespace bslam::image_files
