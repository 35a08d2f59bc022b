// The covariances of the poses of a run as a file.
#pragma once

#include <string>

#include "base/timestamp.h"
#include "session/run_record.h"

namespace bslam::session {

// One line per frame whose pose was estimated by tracking: the capture time minus `subtracted_ns` in ns, and the 21
// elements of the upper triangle, row by row, of the covariance of T_world_cam0 as it was reported in the frame. It is
// that of the small motion d, rotation (rad) first, then translation (map units), in the axes of camera 0, with
// T_world_cam0(true) = T_world_cam0 exp(d), relative to the first keyframe of the submap.
std::string covariance_text(const RunRecord& record, TimeNs subtracted_ns = 0);

}  // namespace bslam::session
