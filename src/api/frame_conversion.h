// Converts the internal record of a frame to the public FrameResult.
#pragma once

#include <bslam/frame_result.h>

#include <cstddef>

#include "camera/rig.h"
#include "tracking/frame_record.h"

namespace bslam::api {

FrameResult to_frame_result(const tracking::FrameRecord& record, const camera::Rig& rig);

}  // namespace bslam::api
