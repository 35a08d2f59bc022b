#include "image_files/image_folder.h"

#include <fmt/format.h>

#include <algorithm>
#include <system_error>

#include "base/atomic_file.h"
#include "base/number_text.h"

namespace bslam::image_files {
namespace {

namespace fs = std::filesystem;

bool is_image_name(const fs::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
  return extension == ".png" || extension == ".jpg" || extension == ".jpeg";
}

}  // namespace

std::string name_of(const ImageFile& image) {
  return image.store ? image.store->name(image.entry) : image.path.string();
}

std::string source_of(const ImageFile& image) {
  return image.store ? image.store->source(image.entry) : image.path.parent_path().string();
}

ImageList in_time_order(std::vector<image_files::ImageFile> images, const std::string& source) {
  ImageList list;
  const auto earlier = [](const image_files::ImageFile& a, const image_files::ImageFile& b) {
    return a.time_ns < b.time_ns;
  };
  if (!std::is_sorted(images.begin(), images.end(), earlier)) {
    list.warnings.push_back(fmt::format("{}: time stamps were out of order and have been sorted", source));
    std::stable_sort(images.begin(), images.end(), earlier);
  }
  const auto last = std::unique(
      images.begin(), images.end(),
      [](const image_files::ImageFile& a, const image_files::ImageFile& b) { return a.time_ns == b.time_ns; });
  if (last != images.end()) {
    list.warnings.push_back(
        fmt::format("{}: {} images with the time stamp of another image are not used", source, images.end() - last));
    images.erase(last, images.end());
  }
  list.images = std::move(images);
  return list;
}

std::vector<NumberedImage> images_in(const fs::path& folder) {
  std::vector<NumberedImage> images;
  std::error_code error;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    const std::string stem = it->path().stem().string();
    if (!is_image_name(it->path()) || stem.find_first_not_of("0123456789") != std::string::npos) continue;
    if (const auto number = parse_integer(stem)) images.push_back({*number, it->path()});
  }
  std::sort(images.begin(), images.end(), [](const NumberedImage& a, const NumberedImage& b) {
    return a.number != b.number ? a.number < b.number : a.path < b.path;
  });
  return images;
}

std::optional<ImageSize> first_image_size(const std::vector<NumberedImage>& images) {
  constexpr std::size_t kTries = 5, kMaxImageBytes = std::size_t{1} << 30;
  for (std::size_t i = 0; i < std::min(kTries, images.size()); ++i) {
    const auto bytes = read_file(images[i].path, kMaxImageBytes);
    const auto size = bytes ? image_size(*bytes) : std::nullopt;
    if (size) return size;
  }
  return std::nullopt;
}

}  // namespace bslam::image_files
