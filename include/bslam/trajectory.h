// Trajectories: poses over time.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>
#include <vector>

#include "bslam/export.h"
#include "bslam/pose.h"
#include "bslam/result.h"

namespace bslam {

struct TimedPose {
  std::int64_t time_ns = 0;
  Pose T_world_frame;  // pose of camera 0 or of the body frame, as requested
};

// Poses with strictly increasing times.
using Trajectory = std::vector<TimedPose>;

// The frame of the rig to which a pose refers: camera 0, or the body frame of the calibration (often the IMU). kCamera0
// is camera 0 as it is in the given calibration. Refining the calibration may rotate camera 0 of MapView::rig() against
// it, by up to about a degree. The body frame remains the same.
enum class RigFrame { kCamera0, kBody };

// Writes the TUM format: a comment with the frame, then one line `t x y z qx qy qz qw` per pose, in seconds and metres
// with nine decimals. `parent` is the name of the frame that the poses are in, without spaces. The file is written
// completely or not at all. Errors: it cannot be written; a name that is empty or contains white space.
BSLAM_EXPORT Status write_tum(const std::filesystem::path& file, const Trajectory& trajectory, RigFrame frame,
                              std::string_view parent = "world");

}  // namespace bslam
