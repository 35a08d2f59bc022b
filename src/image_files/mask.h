// Masks of cameras: images with 0 where a camera sees itself, its robot or nothing of use.
#pragma once

#include "base/result.h"
#include "camera/camera.h"
#include "image/image.h"

namespace bslam::image_files {

// The mask itself. Errors, which name the camera's mask file: another size than the camera's images, 0 everywhere.
Result<image::Image> checked_mask(image::Image mask, const camera::Camera& camera);

}  // namespace bslam::image_files
