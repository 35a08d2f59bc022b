// Initialisation of a map: metric from one frame if cameras overlap, or up to scale from two frames of one camera.
#pragma once

#include <memory>
#include <optional>

#include "estimators/relative_pose.h"
#include "tracking/make_keyframe.h"

namespace bslam::tracking {

// The reference frame of a monocular initialisation, with the data needed to make it a keyframe.
struct StartCandidate {
  std::shared_ptr<const frame::BundledFrame> frame;
  std::vector<image::Pyramid> pyramids;
};

struct StartedMap {
  std::vector<NewKeyframe> keyframes;  // one (metric) or two (up to scale), with ids of the draft
  map::Scale scale = map::Scale::kMetric;
  double scale_deviation = 0;  // relative standard deviation; infinite if the scale is unknown or assumed
};

// Writes the first keyframe, at the origin. Returns nullopt if the frame has too few matched features with accurate
// metric depth.
std::optional<StartedMap> initialise_metric(const frame::BundledFrame& frame, std::span<const image::Pyramid> pyramids,
                                            const InitialisationOptions& options, map::MapDraft& draft);

// Returns true if some camera has enough matches between the two frames to attempt a monocular initialisation.
bool comparable(const frame::BundledFrame& first, const frame::BundledFrame& second,
                const InitialisationOptions& options);

// The frames of a monocular initialisation.
struct StartFrames {
  const StartCandidate& first;
  const frame::BundledFrame& second;
  std::span<const image::Pyramid> pyramids;                             // of the second
  std::span<const std::shared_ptr<const frame::BundledFrame>> between;  // includes the first
  bool scale_needed = false;                                            // the map is started only if its scale is found
};

// Writes two keyframes, the first at the origin, if the relative pose of some camera can be estimated between the
// two frames; else returns nullopt. With one camera the unit is the median depth of the points in the first keyframe,
// and the scale is not estimated later. With several cameras the scale is that of the matched features with accurate
// depth or of images that other cameras captured between the two (tracking/late_cameras.h), or is estimated from the
// matches of all cameras (estimators/generalised_scale.h); if that is too uncertain, the median depth is assumed or a
// larger scale at which the cameras move in one direction. In all cases the scale is unobservable until mapping has
// measured it.
std::optional<StartedMap> initialise_monocular(const StartFrames& frames, const InitialisationOptions& options,
                                               Random random, map::MapDraft& draft);

}  // namespace bslam::tracking
