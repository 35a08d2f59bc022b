// Masks of cameras: images in which 0 marks pixels to ignore, such as views of the rig or robot itself.
#pragma once

#include <filesystem>
#include <optional>

#include "base/result.h"
#include "camera/camera.h"
#include "image/image.h"

namespace bslam::image_files {

// Returns the mask if it is valid. Errors, which name the camera's mask file: the size of the mask differs from the
// camera's resolution; all pixels are 0.
Result<image::Image> checked_mask(image::Image mask, const camera::Camera& camera);

// The recording of bslam live in whose name the name of a mask continues, as in walk.mcap/masks/cam0.png. Returns
// nullopt for a file of its own.
std::optional<std::filesystem::path> recording_around(const std::filesystem::path& mask_file);

}  // namespace bslam::image_files
