// A rig in words, for people.
#pragma once

#include <string>
#include <vector>

#include "camera/rig.h"

namespace bslam::rig_formats {

// Angles the image spans through its optical axis, radians. A side or corner outside of the model's domain counts up to
// where the model ends.
struct FieldOfView {
  double horizontal = 0, vertical = 0, diagonal = 0;
};
FieldOfView field_of_view(const camera::Camera& camera);

// "11.0 cm to the right, 2.0 cm below": a displacement in the frame of camera 0 (x right, y down, z forward), metres.
std::string displacement_in_words(const geometry::Vector3d& displacement);

// Several lines: each camera with its model, resolution, fields of view and place; baselines; overlap.
std::string describe_rig(const camera::Rig& rig);

}  // namespace bslam::rig_formats
