// Names of cameras that are added to others.
#pragma once

#include <span>
#include <string>

#include "camera/rig.h"

namespace bslam::camera {

// Returns the name of a camera that is added after these ones: its own, or "cam" with its number if one of them has
// that name already.
std::string unused_name(std::span<const RigCamera> taken, const std::string& name);

}  // namespace bslam::camera
