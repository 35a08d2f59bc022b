// Scale of a map that was started by one camera, once an overlapping camera has images too.
#pragma once

#include <optional>
#include <vector>

#include "frame/bundled_frame.h"
#include "map/bundled_map.h"
#include "tracking/frame_matches.h"
#include "tracking/options.h"

namespace bslam::tracking {

// The median of ratios of distances, and the standard deviation of the logarithm of one ratio, which wrong ones hardly
// change.
struct MedianRatio {
  double ratio = 1, deviation = 0;
};

// `ratios` must not be empty.
MedianRatio median_ratio(std::vector<double> ratios);

// Compares features that several cameras of the frame matched with their landmarks, which single cameras have mapped so
// far: the factor is the median ratio of their distances. In such a map the landmarks are searched for at wrong places
// in the other cameras, so that what is found there seems to confirm its scale; the Bundled table does not depend on
// the map. `T_rig_world`: pose of the frame. Returns nullopt if the scale is known, if too few features show it, or if
// it hardly differs from that of the map. Mapping applies it (mapping/scale_observation.h).
std::optional<frame::StereoScale> stereo_scale(const map::BundledMap& map, const frame::BundledFrame& frame,
                                               const FrameMatches& matches, const geometry::SE3& T_rig_world,
                                               const InitialisationOptions& options);

}  // namespace bslam::tracking
