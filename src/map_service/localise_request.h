// The images of a request for localisation.
#pragma once

#include <string_view>

#include "base/result.h"
#include "camera/rig.h"
#include "image/image_bundle.h"

namespace bslam::map_service {

// Reads a form (web_server/multipart.h) whose parts are PNG, JPEG, WebP or PNM files, named as cameras of the rig. The
// images count as those of one frame: all have the time stamp 0, to which the time offset of their camera is added.
// Cameras without a part have no image. No more pixels are decoded than the cameras have. Errors, each one sentence for
// the client: those of parse_form, no part, a part that is not named as a camera or is named as one before, an image
// that is incomplete or of another format, an image whose size is not that of the camera.
Result<image::ImageBundle> images_of_request(std::string_view content_type, std::string_view body,
                                             const camera::Rig& rig);

}  // namespace bslam::map_service
