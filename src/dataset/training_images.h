// Pictures to learn from: photographs of any usual format and size.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"
#include "image/image.h"

namespace bslam::dataset {

// The PNG, JPEG, PGM and WebP files among `paths` and, by name, in the folders among them and below; each folder's in
// the order of their paths, none twice. Errors: a path that is not there or cannot be searched, a file of another kind.
Result<std::vector<std::filesystem::path>> find_images(const std::vector<std::string>& paths);

// Grey, and shrunk by averaging until no side is longer than `max_side` pixels (0: as it is). Errors: not readable, no
// whole image.
Result<image::Image> read_training_image(const std::filesystem::path& file, int max_side);

}  // namespace bslam::dataset
