// Folders with the vignettes of cameras: camN.png for camera N of the recording (image_decoding/vignette.h).
#pragma once

#include <filesystem>
#include <vector>

#include "base/result.h"
#include "camera/rig.h"
#include "image_decoding/vignette.h"

namespace bslam::dataset {

// Reads the vignettes of the cameras of a rig, in order; those of cameras without a file are empty. `cameras` are the
// numbers of the rig's cameras in the recording. Errors: the folder does not exist or has no file for any of the
// cameras; a vignette is not usable.
Result<std::vector<image_decoding::Vignette>> read_vignettes(const camera::Rig& rig, const std::vector<int>& cameras,
                                                             const std::filesystem::path& folder);

}  // namespace bslam::dataset
