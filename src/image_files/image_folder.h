// Lists of images: files in time order, and folders of images named by numbers.
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
  TimeNs time_ns = 0;               // time of capture, with the time offset of the camera applied
  std::filesystem::path mask = {};  // file of a mask of this image alone; empty: none
};

// Images of one camera with their recorded time stamps, strictly increasing.
struct ImageList {
  std::vector<ImageFile> images;
  std::vector<std::string> warnings;
};

// Sorts by time and removes the second of two images with equal time stamps. Both are reported in the warnings, which
// name `source`.
ImageList in_time_order(std::vector<ImageFile> images, const std::string& source);

struct NumberedImage {
  std::int64_t number = 0;
  std::filesystem::path path;
};

// Returns the PNG and JPEG files of a folder whose names are numbers, ordered by number. The list is empty if the
// folder does not exist.
std::vector<NumberedImage> images_in(const std::filesystem::path& folder);

// Returns the size of the first image with a readable header among the first few images, or nullopt.
std::optional<ImageSize> first_image_size(const std::vector<NumberedImage>& images);

}  // namespace bslam::image_files
