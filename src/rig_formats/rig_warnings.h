// What of a rig is hardly meant: slips of units, frames and directions that a calibration file cannot be refused for.
#pragma once

#include <string>
#include <vector>

#include "camera/rig.h"

namespace bslam::rig_formats {

// A line each:
// - two cameras at one place (below 1 mm), with one pose, or further apart than 5 m;
// - a principal point outside of the image or far from its middle, pixels far from square;
// - a field of view no lens of the model has; a lens model that answers for part of the image alone;
// - cameras that look through each other; extrinsics that would make more sense inverted: all cameras in one place, in
//   each other's view, or above each other where inverted they stand beside each other.
std::vector<std::string> rig_warnings(const camera::Rig& rig);

// How much cameras stand in each other's way, 0 to 1, mean over pairs: for cameras that look the same way the share of
// their baseline along the view, for others how far each looks across the other instead of away from it.
double obstruction(const camera::Rig& rig);

// The rig as it is if its file holds T_cam_body where T_body_cam is meant.
camera::Rig with_inverse_extrinsics(const camera::Rig& rig);

// "1.20 m", "11.0 cm", "0.4 mm"
std::string length_in_words(double metres);

}  // namespace bslam::rig_formats
