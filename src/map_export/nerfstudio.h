// Keyframes as a data set of nerfstudio.
#pragma once

#include <string>
#include <vector>

#include "base/result.h"
#include "map_export/image_table.h"
#include "map_export/output_cameras.h"

namespace bslam::map_export {

// Returns transforms.json: one frame per image with its own intrinsics, and its pose in the upright axes of the
// selection with the axes of OpenGL (x right, y up, z backward). `paths`: file_path of each image of the table. `ply`:
// name of the point cloud in upright axes. The origin of pixel coordinates is the corner of the top-left pixel. Error
// (file left empty): nerfstudio has one type of camera per data set, pinholes with k1 k2 k3 p1 p2 or Kannala-Brandt
// fisheyes.
Result<std::string> nerfstudio_json(const Selection& selection, const ImageTable& images, const OutputCameras& cameras,
                                    const std::vector<std::string>& paths, const std::string& ply);

}  // namespace bslam::map_export
