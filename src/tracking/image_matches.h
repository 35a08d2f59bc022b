// Matches between two images of one camera, if nothing is known of its motion.
#pragma once

#include <vector>

#include "feature/descriptor_matching.h"
#include "feature/keypoints.h"

namespace bslam::tracking {

// Keypoints whose descriptors are the best matches of each other, on levels of similar size, and whose bearings differ
// by a small angle.
std::vector<feature::DescriptorMatch> match_images(const feature::Keypoints& a, const feature::Keypoints& b);

}  // namespace bslam::tracking
