// 8-bit grey images: Image owns its pixels, ImageView refers to pixels owned elsewhere.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace bslam::image {

// Non-owning view of row-major pixels. `stride` is the distance between rows in bytes.
struct ImageView {
  const std::uint8_t* data = nullptr;
  int width = 0, height = 0;
  std::ptrdiff_t stride = 0;

  bool empty() const { return data == nullptr || width <= 0 || height <= 0; }
  const std::uint8_t* row(int y) const { return data + y * stride; }
  std::uint8_t at(int x, int y) const { return row(y)[x]; }
};

// Returns true if the pixel of `mask` nearest to (x, y) is not 0, or the mask is empty.
inline bool allows(const ImageView& mask, double x, double y) {
  if (mask.empty()) return true;
  const int column = std::clamp(static_cast<int>(std::lround(x)), 0, mask.width - 1);
  const int row = std::clamp(static_cast<int>(std::lround(y)), 0, mask.height - 1);
  return mask.at(column, row) != 0;
}

class Image {
 public:
  Image() = default;
  Image(int width, int height) { resize(width, height); }

  // Reuses the allocated memory if it is large enough. The pixels are undefined after a change of size.
  void resize(int width, int height) {
    width_ = width;
    height_ = height;
    pixels_.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  }

  int width() const { return width_; }
  int height() const { return height_; }
  bool empty() const { return pixels_.empty(); }
  std::size_t memory_bytes() const { return pixels_.capacity(); }
  std::uint8_t* row(int y) { return pixels_.data() + static_cast<std::ptrdiff_t>(y) * width_; }
  const std::uint8_t* row(int y) const { return pixels_.data() + static_cast<std::ptrdiff_t>(y) * width_; }
  ImageView view() const { return {pixels_.data(), width_, height_, width_}; }

 private:
  int width_ = 0, height_ = 0;
  std::vector<std::uint8_t> pixels_;
};

// An image with the pixels of a view.
inline Image copy_of(const ImageView& view) {
  Image out(view.width, view.height);
  for (int y = 0; y < view.height; ++y) std::copy_n(view.row(y), view.width, out.row(y));
  return out;
}

}  // namespace bslam::image
