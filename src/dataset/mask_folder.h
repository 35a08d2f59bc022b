// Masks in a folder, in which 0 marks pixels to ignore: camN.png for all images of camera N of a recording, and
// camN/STAMP.png for the image with this time stamp.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"
#include "camera/rig.h"
#include "image/image.h"
#include "image_files/image_folder.h"

namespace bslam::dataset {

// Returns the rig with the masks of whole cameras of a folder in place of those of its calibration; cameras without a
// file keep theirs. `cameras` are the numbers of the rig's cameras in the recording. The masks are not read. Errors:
// the folder does not exist, or it has neither a mask of one of these cameras nor of their images.
Result<camera::Rig> with_masks(const camera::Rig& rig, const std::vector<int>& cameras,
                               const std::filesystem::path& folder);

// Returns warnings for images in the folder that are no masks by their names, or masks of cameras beyond the `count` of
// the calibration.
std::vector<std::string> masks_not_used(const std::filesystem::path& folder, std::size_t count);

// Adds the masks of single images of camera `number` to its images, whose times are the recorded ones in ns. STAMP is
// this time or the number by which the image's file is named. Returns warnings for the user, if masks belong to no
// image. Errors: no mask belongs to an image; the first one cannot be read or has another size than the images.
Result<std::vector<std::string>> add_image_masks(const std::filesystem::path& folder, int number,
                                                 const camera::Camera& camera,
                                                 std::vector<image_files::ImageFile>& images);

// Reads the mask of an image, which may be 0 everywhere. Errors: the file cannot be read or differs from the resolution
// of the camera.
Result<image::Image> read_image_mask(const std::filesystem::path& file, const camera::Camera& camera);

}  // namespace bslam::dataset
