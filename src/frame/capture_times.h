// Cameras that do not fire together.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "camera/rig.h"
#include "image/image_bundle.h"

namespace bslam::frame {

// Two images this close in time were taken together: a rig turning at 1 rad/s moves them by a pixel.
constexpr TimeNs kTogetherNs = 2'000'000;

// Flags the cameras to leave out as long as the motion of the rig is unknown: those not `skipped` whose image was not
// taken together with the frame. None where without them nothing were left, or no overlapping views of a rig that has
// such.
std::vector<std::uint8_t> without_late_cameras(const camera::Rig& rig, const image::ImageBundle& images,
                                               std::span<const std::uint8_t> skipped);

}  // namespace bslam::frame
