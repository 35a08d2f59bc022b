// Lists of images: files in time order, and folders of images named by a number. Internal to io.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/timestamp.h"
#include "image_files/image_size.h"

namespace bslam::image_files {

struct ImageFile {
  std::filesystem::path path;
  TimeNs time_ns = 0;  // of capture: the camera's time offset is applied
};

// Images of one camera with their times as recorded, strictly increasing.
struct ImageList {
  std::vector<ImageFile> images;
  std::vector<std::string> warnings;
};

// Sorts by time and drops the second of two images with one time; says so in the warnings, which name `source`.
ImageList in_time_order(std::vector<ImageFile> images, const std::string& source);

struct NumberedImage {
  std::int64_t number = 0;
  std::filesystem::path path;
};

// The PNG and JPEG files of a folder whose names are numbers, by number; none where there is no such folder.
std::vector<NumberedImage> images_in(const std::filesystem::path& folder);

// Size that the first image tells, of the first few that do.
std::optional<ImageSize> first_image_size(const std::vector<NumberedImage>& images);

}  // namespace bslam::image_files
