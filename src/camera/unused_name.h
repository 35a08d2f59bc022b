// Unique names for cameras that are added to a list of cameras.
#pragma once

#include <span>
#include <string>

#include "camera/rig.h"

namespace bslam::camera {

// Returns the name for a camera that is appended to these: its own name, or "cam" and its index if its own name is
// already used.
std::string unused_name(std::span<const RigCamera> taken, const std::string& name);

}  // namespace bslam::camera
