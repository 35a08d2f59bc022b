// Colours of landmarks, from the images that observe them.
#pragma once

#include <array>
#include <cstdint>
#include <stop_token>
#include <vector>

#include "map_export/image_table.h"

namespace bslam::map_export {

using Colour = std::array<std::uint8_t, 3>;  // red, green, blue

struct LandmarkColours {
  std::vector<Colour> of;  // per selected landmark, in their order; grey (128) if no image of it could be read
  std::size_t read = 0;    // number of images that were read
};

// The mean of the colours at all keypoints of each landmark. Images without a file, or that cannot be read or have
// another size than their camera, are ignored. After a stop request, no further images are read.
LandmarkColours landmark_colours(const Selection& selection, const ImageTable& images,
                                 const std::stop_token& interrupted = {});

}  // namespace bslam::map_export
