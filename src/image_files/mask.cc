#include "image_files/mask.h"

#include <fmt/format.h>

#include <algorithm>
#include <span>
#include <system_error>
#include <utility>

namespace bslam::image_files {

Result<image::Image> checked_mask(image::Image mask, const camera::Camera& camera) {
  if (mask.width() != camera.width || mask.height() != camera.height) {
    return Error{camera.mask_file, "", fmt::format("{}x{} pixels", mask.width(), mask.height()),
                 fmt::format("{}x{}, the resolution of {}", camera.width, camera.height, camera.name)};
  }
  const std::span pixels(mask.row(0), static_cast<std::size_t>(mask.width()) * static_cast<std::size_t>(mask.height()));
  if (std::ranges::all_of(pixels, [](std::uint8_t p) { return p == 0; })) {
    return Error{camera.mask_file, "", "only zeros, which mask the whole image of " + camera.name,
                 "positive values for the pixels to use"};
  }
  return mask;
}

std::optional<std::filesystem::path> recording_around(const std::filesystem::path& mask_file) {
  std::error_code error;
  for (auto outer = mask_file.parent_path(); outer.has_relative_path(); outer = outer.parent_path()) {
    if (std::filesystem::is_regular_file(outer, error)) return outer;
  }
  return std::nullopt;
}

}  // namespace bslam::image_files
