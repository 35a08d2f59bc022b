// Vignetting: the loss of brightness towards the corners of a camera's images, and its correction.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "base/result.h"
#include "camera/camera.h"
#include "image/image.h"

namespace bslam::image_decoding {

class Vignette {
 public:
  Vignette() = default;  // none: images remain as they are

  // From a grey image of 8 or 16 bits with the resolution of the camera, whose values are proportional to the
  // brightness in the images of an evenly lit surface, such as vignette.png of TUM-VI. Errors: the file cannot be read,
  // has another resolution, or is 0 everywhere.
  static Result<Vignette> read(const std::filesystem::path& file, const camera::Camera& camera);

  bool empty() const { return gain_.empty(); }
  // Corrects the vignetting: scales every pixel to the brightness at the brightest place of the vignette, by a factor
  // of at most 8. Values above 255 become 255. The image must have the resolution of the camera, and values
  // proportional to the brightness.
  void correct(image::Image& image) const;

 private:
  std::vector<std::uint16_t> gain_;  // per pixel, row-major, in units of 1/256
};

}  // namespace bslam::image_decoding
