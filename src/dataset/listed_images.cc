#include "dataset/listed_images.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <unordered_set>
#include <utility>

namespace bslam::dataset {

namespace fs = std::filesystem;

image_files::ImageList listed_images(std::vector<image_files::ImageFile> images, const fs::path& file,
                                     const fs::path& folder, const std::vector<fs::path>& present,
                                     image_files::StampUnit unit) {
  std::unordered_set<std::string> unlisted;
  for (const fs::path& image : present) unlisted.insert(image.filename().string());
  for (const image_files::ImageFile& image : images) unlisted.erase(image.path.filename().string());
  image_files::ImageList list = image_files::in_time_order(std::move(images), file.string(), unit);
  if (!unlisted.empty()) {
    list.warnings.push_back(fmt::format("{}: {} of {} images in {} are not listed and are not used, the first: {}",
                                        file.string(), unlisted.size(), present.size(), folder.string(),
                                        *std::ranges::min_element(unlisted)));
  }
  return list;
}

}  // namespace bslam::dataset
