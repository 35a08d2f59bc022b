// Lists of images: files in time order, and folders of images named by numbers.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/timestamp.h"
#include "image_files/image_size.h"
#include "image_files/image_store.h"

namespace bslam::image_files {

// The location of an image: a separate file, or an entry of a recording.
struct ImageFile {
  std::filesystem::path path;       // empty if the image is in a store
  TimeNs time_ns = 0;               // time of capture, with the time offset of the camera applied
  std::filesystem::path mask = {};  // file of a mask of this image alone; empty: none
  std::shared_ptr<const ImageStore> store = {};
  std::int64_t entry = 0;  // number of the image in the store
  // Time of the frame in which the image was recorded; images of different cameras with the same number form one frame.
  // nullopt: unknown.
  std::optional<TimeNs> frame_ns = {};
};

// Returns true if a file has the name of an image of a kind that can be decoded.
bool is_image_name(const std::filesystem::path& file);
// The same for PNG and JPEG only.
bool is_png_or_jpeg_name(const std::filesystem::path& file);

// Text for messages: the file of an image, or its location in a recording.
std::string name_of(const ImageFile& image);
// Text for messages: the folder or the topic of an image.
std::string source_of(const ImageFile& image);

// Images of one camera with their recorded time stamps, strictly increasing.
struct ImageList {
  std::vector<ImageFile> images;
  std::vector<std::string> warnings;
  bool sorted = false;  // the images were not in order of time, and a warning says so
};

// How messages write time stamps: as the whole numbers that they are in a file or in names, or in seconds.
enum class StampUnit { kOfFile, kSeconds };

// Sorts by time and removes the second of two images with equal time stamps. A stamp of 0 among others that are far
// from 0 is damaged, and its image is removed. All three are reported in the warnings, which name `source`.
ImageList in_time_order(std::vector<ImageFile> images, const std::string& source, StampUnit unit = StampUnit::kOfFile);

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
