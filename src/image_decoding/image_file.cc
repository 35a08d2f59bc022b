#include "image_decoding/image_file.h"

#include <algorithm>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <utility>

#include "base/atomic_file.h"
#include "image_files/mask.h"
#include "image_files/png_decoder.h"

namespace bslam::image_decoding {
namespace {

constexpr std::size_t kMaxImageBytes = std::size_t{1} << 30;

// Returns true if the bytes start as a JPEG and end with the end-of-image marker. Zeros after it, which some recorders
// add, are allowed.
bool is_whole_jpeg(std::string_view bytes) {
  if (!bytes.starts_with("\xff\xd8\xff")) return false;
  const std::size_t last = bytes.find_last_not_of('\0');
  return last != std::string_view::npos && bytes.substr(0, last + 1).ends_with("\xff\xd9");
}

std::optional<image::Image> decode_with_opencv(std::string_view bytes) {
  const cv::Mat buffer(1, static_cast<int>(bytes.size()), CV_8UC1, const_cast<char*>(bytes.data()));
  cv::Mat decoded;
  try {
    decoded = cv::imdecode(buffer, cv::IMREAD_GRAYSCALE | cv::IMREAD_IGNORE_ORIENTATION);
  } catch (const cv::Exception&) {
    return std::nullopt;  // a header with an impossible size: the file is damaged
  }
  if (decoded.empty()) return std::nullopt;
  image::Image image(decoded.cols, decoded.rows);
  for (int y = 0; y < decoded.rows; ++y) std::copy_n(decoded.ptr<std::uint8_t>(y), decoded.cols, image.row(y));
  return image;
}

}  // namespace

std::optional<image::Image> decode_grey(std::string_view bytes) {
  if (bytes.size() > kMaxImageBytes) return std::nullopt;
  if (image_files::is_complete_png(bytes)) {
    auto image = image_files::decode_grey_png(bytes);
    return image ? std::move(image) : decode_with_opencv(bytes);
  }
  return is_whole_jpeg(bytes) ? decode_with_opencv(bytes) : std::nullopt;
}

Result<image::Image> read_image(const std::filesystem::path& file) {
  const auto bytes = read_file(file, kMaxImageBytes);
  if (!bytes) return bytes.error();
  auto image = decode_grey(*bytes);
  if (!image) return Error{file.string(), "", "an incomplete image or another format", "a complete PNG or JPEG image"};
  return *std::move(image);
}

Result<image::Image> read_mask(const camera::Camera& camera) {
  if (camera.mask_file.empty()) return image::Image();
  auto mask = read_image(camera.mask_file);
  if (!mask) return mask;
  return image_files::checked_mask(*std::move(mask), camera);
}

Result<std::vector<image::Image>> read_masks(const camera::Rig& rig) {
  std::vector<image::Image> masks;
  for (std::size_t c = 0; c < rig.size(); ++c) {
    auto mask = read_mask(rig.camera(c));
    if (!mask) return mask.error();
    masks.push_back(std::move(*mask));
  }
  return masks;
}

}  // namespace bslam::image_decoding
