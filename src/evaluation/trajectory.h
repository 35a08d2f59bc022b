// A trajectory: timestamped poses, ordered by time.
#pragma once

#include <string>
#include <vector>

#include "base/timestamp.h"
#include "geometry/se3.h"

namespace bslam::evaluation {

struct TimedPose {
  TimeNs time_ns = 0;
  geometry::SE3 T_world_frame;  // pose of the moving frame (camera 0 or body) in the world
};

// Times are strictly increasing.
using Trajectory = std::vector<TimedPose>;

}  // namespace bslam::evaluation
