// Which camera of a rig a trajectory belongs to.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>

#include "base/result.h"
#include "camera/rig.h"
#include "evaluation/trajectory_header.h"

namespace bslam::cli {

// The camera of the rig whose poses the trajectory contains: `option` (--camera) if given, else the one that its
// comments name; camera 0 if they name none. Prints a note if both contradict each other. Errors: there
// is no such camera; the trajectory is that of a body, or has other axes.
Result<std::size_t> camera_of_trajectory(const std::filesystem::path& trajectory,
                                         const evaluation::TrajectoryComments& comments, const camera::Rig& rig,
                                         const std::filesystem::path& rig_file, std::optional<int> option);

}  // namespace bslam::cli
