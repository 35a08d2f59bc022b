// Extraction and bundling of a single frame, without tracking.
#pragma once

#include <vector>

#include "camera/rig.h"
#include "frame/bundled_frame.h"
#include "image/image_bundle.h"
#include "system/config.h"

namespace bslam::system {

// The frame of `images`, which has one entry per camera of the rig, with equal budgets for all cameras. Masks: one per
// camera; an empty image means no mask.
frame::BundledFrame single_frame(const camera::Rig& rig, const Config& config, std::vector<image::Image> masks,
                                 const image::ImageBundle& images);

}  // namespace bslam::system
