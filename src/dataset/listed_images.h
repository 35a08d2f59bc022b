// The images that a list of times names.
#pragma once

#include <filesystem>
#include <vector>

#include "image_files/image_folder.h"

namespace bslam::dataset {

// As image_files::in_time_order() for the images that `file` names. A warning tells of those of `present`, the images
// in `folder`, that it does not name.
image_files::ImageList listed_images(std::vector<image_files::ImageFile> images, const std::filesystem::path& file,
                                     const std::filesystem::path& folder,
                                     const std::vector<std::filesystem::path>& present, image_files::StampUnit unit);

}  // namespace bslam::dataset
