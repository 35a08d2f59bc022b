// One frame as the caller is told of it. The only place that knows both records.
#pragma once

#include <bslam/frame_result.h>

#include <cstddef>

#include "camera/rig.h"
#include "tracking/frame_record.h"

namespace bslam::api {

FrameResult to_frame_result(const tracking::FrameRecord& record, const camera::Rig& rig);

}  // namespace bslam::api
