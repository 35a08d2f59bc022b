// Poses over time.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "bslam/export.h"
#include "bslam/pose.h"
#include "bslam/result.h"

namespace bslam {

struct TimedPose {
  std::int64_t time_ns = 0;
  Pose T_world_frame;  // of camera 0 or of the body frame, as asked for
};

// Strictly increasing in time.
using Trajectory = std::vector<TimedPose>;

// Which of the rig's frames a pose is of: camera 0, or the frame its calibration gives the cameras in (often the IMU).
enum class RigFrame { kCamera0, kBody };

// Writes TUM's format: `t x y z qx qy qz qw` a line, seconds and metres with nine decimals, below a comment that names
// the frame. The file appears whole or not at all. Error: it cannot be written.
BSLAM_EXPORT Status write_tum(const std::filesystem::path& file, const Trajectory& trajectory, RigFrame frame);

}  // namespace bslam
