// Plausibility checks of a rig: likely mistakes of units, frame conventions and axes, which are not errors.
#pragma once

#include <string>
#include <vector>

#include "camera/rig.h"

namespace bslam::calibration {

// One line for each of:
// - two cameras closer than 1 mm, with equal poses, or further apart than 5 m;
// - a principal point outside of the image or far from its centre, and pixels that are far from square;
// - a field of view that is implausible for the camera model, and a model that is valid for a part of the image only;
// - a time offset of half a second or more;
// - cameras in the view of each other, and extrinsics that are more plausible when inverted: all cameras at the same
//   position, in the view of each other, or above each other instead of side by side.
std::vector<std::string> rig_warnings(const camera::Rig& rig);

// How much the cameras are in the view of each other, from 0 to 1, averaged over all pairs. For cameras with similar
// viewing directions, this is the component of the unit baseline along the view; for others, how much they face each
// other.
double obstruction(const camera::Rig& rig);

// The rig with inverted extrinsics, as if its file contained T_cam_body instead of T_body_cam.
camera::Rig with_inverse_extrinsics(const camera::Rig& rig);

// "1.20 m", "11.0 cm", "0.4 mm"
std::string length_in_words(double metres);

}  // namespace bslam::calibration
