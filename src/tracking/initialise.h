// Initialisation of a map: from one frame whose cameras overlap, in metres, or from two frames of one camera, up to
// scale.
#pragma once

#include <memory>
#include <optional>

#include "estimators/relative_pose.h"
#include "tracking/make_keyframe.h"

namespace bslam::tracking {

// The reference frame of a monocular initialisation, with what is needed to make it a keyframe.
struct StartCandidate {
  std::shared_ptr<const frame::BundledFrame> frame;
  std::vector<image::Pyramid> pyramids;
};

struct StartedMap {
  std::vector<NewKeyframe> keyframes;  // one (metric) or two (up to scale), in the draft
  map::Scale scale = map::Scale::kMetric;
  double scale_deviation = 0;  // relative; infinite where the length of the map's unit is not known, or a guess
};

// Writes the first keyframe, at the origin. Empty where the frame has too few matched features of sound metric depth.
std::optional<StartedMap> initialise_metric(const frame::BundledFrame& frame, std::span<const image::Pyramid> pyramids,
                                            const InitialisationOptions& options, map::MapDraft& draft);

// Do the two frames share enough matches in some camera for a start up to scale to be tried?
bool comparable(const frame::BundledFrame& first, const frame::BundledFrame& second,
                const InitialisationOptions& options);

// Writes two keyframes where some camera sees enough parallax between `first` and `frame`: the first at the origin.
// With one camera the median depth of the points in the first is 1, and stays so. With several, none overlapping, the
// scale is what their matches tell of it (estimators/generalised_scale.h), else the guessed depth: unobservable either
// way, until mapping has measured it.
std::optional<StartedMap> initialise_monocular(const StartCandidate& first, const frame::BundledFrame& frame,
                                               std::span<const image::Pyramid> pyramids,
                                               const InitialisationOptions& options, Random random,
                                               map::MapDraft& draft);

}  // namespace bslam::tracking
