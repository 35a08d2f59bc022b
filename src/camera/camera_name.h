// Cameras of a rig by their names.
#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "camera/rig.h"

namespace bslam::camera {

// The camera of this name, or, if no camera has it, number N of a name camN; nullopt if there is none.
std::optional<std::size_t> camera_named(const std::string& name, const Rig& rig);

// The camera whose poses a trajectory contains, by the frame that its first line names: camera 0 if the line names none
// or cam0, which is camera 0 whatever its name. nullopt if there is no such camera: the frame is that of a body, has
// other axes, or the trajectory is that of another rig.
std::optional<std::size_t> camera_of_frame(const std::string& frame, const Rig& rig);

}  // namespace bslam::camera
