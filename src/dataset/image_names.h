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
// Returns true if a file of this name may be an image, also of a kind that cannot be decoded.
bool may_be_image(const std::filesystem::path& file);

// Orders names as people do: numbers in them are compared by value, so that image_2 is before image_10.
bool naturally_before(const std::string& a, const std::string& b);

struct NamedImages {
  std::vector<image_files::ImageFile> images;  // in the order of time_ns: the number in the name, or nanoseconds
  bool in_seconds = false;                     // the names are decimal seconds, so that time_ns are nanoseconds
  std::string left_out = {};                   // an example of the files that are not used
  std::size_t left_out_count = 0;
};

// Reads the numbers of the names: all digits, or those digits that differ between the names, which have the same text
// before and behind them. Two of them with a point between are decimal seconds. Files with other names are left out if
// they are single ones, or if others have names of digits only. Digits behind the point that are not as many in all
// names are decimals without zeros at their ends, or whole numbers of ns, us or ms without zeros at their beginnings,
// whichever is possible or gives nearly equal intervals. Errors: no images; names of several kinds; names in which
// several numbers differ; fractions of a second whose unit is ambiguous.
Result<NamedImages> images_by_name(const std::filesystem::path& folder,
                                   const std::vector<std::filesystem::path>& files);

}  // namespace bslam::dataset
