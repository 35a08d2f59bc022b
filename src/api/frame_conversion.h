// One frame as the caller is told of it. The only place that knows both records.
#pragma once

#include <bslam/frame_result.h>

#include <cstddef>

#include "camera/rig.h"
#include "system/frame_record.h"

namespace bslam::api {

// `before`: the record of the frame before, from which the velocity follows; may be null.
FrameResult to_frame_result(const system::FrameRecord& record, const system::FrameRecord* before,
                            const camera::Rig& rig);

}  // namespace bslam::api
