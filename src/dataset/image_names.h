// The images of a folder, ordered by the numbers or decimal seconds in their names.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"
#include "image_files/image_folder.h"

namespace bslam::dataset {

// Returns the files of a folder that have the name of an image that can be decoded, ordered by name.
std::vector<std::filesystem::path> image_files_of(const std::filesystem::path& folder);
// Returns true if a file has the name of an image of a kind that cannot be decoded.
bool is_undecodable_image(const std::filesystem::path& file);

// Orders names as people do: numbers in them are compared by value, so that image_2 is before image_10.
bool naturally_before(const std::string& a, const std::string& b);

struct NamedImages {
  // In the order of time_ns, which is the number in the name in its own unit, or nanoseconds if `in_seconds`.
  std::vector<image_files::ImageFile> images;
  bool in_seconds = false;    // the names are decimal seconds
  std::string left_out = {};  // an example of the files that are not used
  std::size_t left_out_count = 0;
};

// Reads the numbers of the names. The number is the whole stem if it has digits only, else the one number that varies;
// the text around it must be the same in all names. Two numbers joined by a point are decimal seconds. Files with other
// names are left out if they are single ones, or if others have names of digits only. If the number of digits after the
// point varies, either trailing zeros of the fraction were dropped, or leading zeros of an integer number of ns, us or
// ms: whichever is possible or gives nearly equal intervals. Errors: no images; names of several kinds; names in which
// several numbers differ; fractions of a second whose unit is ambiguous.
Result<NamedImages> images_by_name(const std::filesystem::path& folder,
                                   const std::vector<std::filesystem::path>& files);

}  // namespace bslam::dataset
