// The landmarks as a point cloud.
#pragma once

#include <string>

#include "map_export/landmark_colours.h"

namespace bslam::map_export {

// Returns the selected landmarks as a binary PLY: x, y, z (double), red, green, blue (uchar), and the number of
// keypoints that observe them (int). Positions are transformed by T_out_world.
std::string landmarks_ply(const Selection& selection, const LandmarkColours& colours,
                          const geometry::SE3& T_out_world = {});

}  // namespace bslam::map_export
