#include "dataset/training_images.h"

#include <algorithm>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <set>
#include <system_error>
#include <utility>

#include "base/atomic_file.h"
#include "image_decoding/image_file.h"
#include "image_files/image_folder.h"

namespace bslam::dataset {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxImageBytes = std::size_t{1} << 28;

Result<std::vector<fs::path>> images_below(const fs::path& folder) {
  std::vector<fs::path> found;
  std::error_code error;
  for (fs::recursive_directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    std::error_code unreadable;
    if (image_files::is_image_name(it->path()) && it->is_regular_file(unreadable)) found.push_back(it->path());
  }
  if (error) return Error{folder.string(), "", error.message(), "a folder that can be searched"};
  std::sort(found.begin(), found.end());
  return found;
}

image::Image shrink(const image::Image& image, int max_side) {
  const double factor = static_cast<double>(max_side) / std::max(image.width(), image.height());
  image::Image small(std::max(1, static_cast<int>(image.width() * factor)),
                     std::max(1, static_cast<int>(image.height() * factor)));
  const cv::Mat from(image.height(), image.width(), CV_8UC1, const_cast<std::uint8_t*>(image.row(0)));
  cv::Mat to(small.height(), small.width(), CV_8UC1, small.row(0));
  cv::resize(from, to, to.size(), 0, 0, cv::INTER_AREA);
  return small;
}

}  // namespace

Result<std::vector<fs::path>> find_images(const std::vector<std::string>& paths) {
  std::vector<fs::path> images;
  std::set<fs::path> seen;
  const auto take = [&](const fs::path& image) {
    if (seen.insert(image.lexically_normal()).second) images.push_back(image);
  };
  for (const std::string& path : paths) {
    std::error_code error;
    const fs::file_status status = fs::status(path, error);
    if (fs::is_directory(status)) {
      const auto below = images_below(path);
      if (!below) return below.error();
      for (const fs::path& image : *below) take(image);
    } else if (!fs::exists(status)) {
      return Error{path, "", error ? error.message() : "No such file or directory", "an image or a folder of images"};
    } else if (!image_files::is_image_name(path)) {
      return Error{path, "", "a file of another type", "a PNG, JPEG, WebP, PNM, BMP or TIFF image, or a folder"};
    } else {
      take(path);
    }
  }
  return images;
}

Result<image::Image> read_training_image(const fs::path& file, int max_side) {
  const auto bytes = read_file(file, kMaxImageBytes);
  if (!bytes) return bytes.error();
  auto image = image_decoding::decode_grey(*bytes);
  if (!image)
    return Error{file.string(), "", "an incomplete image or another format",
                 "a PNG, JPEG, WebP, PNM, BMP or TIFF image"};
  const bool large = max_side > 0 && std::max(image->width(), image->height()) > max_side;
  return large ? shrink(*image, max_side) : *std::move(image);
}

}  // namespace bslam::dataset
