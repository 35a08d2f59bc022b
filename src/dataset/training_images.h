// Training images for vocabularies, in any common format and size.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"
#include "image/image.h"

namespace bslam::dataset {

// Returns the PNG, JPEG, WebP, PNM, BMP and TIFF files in `paths`, and the files with such names in folders in `paths`
// and their subfolders. The files of a folder are ordered by path; duplicates are removed. Errors: a path that does not
// exist or cannot be searched; a file of another type.
Result<std::vector<std::filesystem::path>> find_images(const std::vector<std::string>& paths);

// Reads a grey image and scales it down by averaging so that no side is longer than `max_side` pixels (0: no limit).
// Errors: the file cannot be read or is not a complete image.
Result<image::Image> read_training_image(const std::filesystem::path& file, int max_side);

}  // namespace bslam::dataset
