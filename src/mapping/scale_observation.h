// Estimates the metric scale of a map that was initialised without it, from the motion of a rig without overlapping
// cameras.
#pragma once

#include <limits>

#include "map/map_edit.h"
#include "mapping/options.h"

namespace bslam::mapping {

struct ScaleReport {
  bool observed = false;                                       // true if the images constrain the scale
  double correction = 1;                                       // factor by which the submap was scaled in the draft
  double deviation = std::numeric_limits<double>::infinity();  // relative standard deviation of the map scale
  int keyframes = 0;                                           // number of keyframes used
};

// If the scale of the draft's map is kUnobservable, or is metric, was estimated from motion and is due for a check,
// estimates it from `keyframe` and its best covisible keyframes, scales their submap accordingly, and stores the
// deviation in the draft. An estimate that is too uncertain changes nothing (ScaleOptions::max_correcting_deviation). A
// metric scale that the estimate contradicts becomes kUnobservable.
ScaleReport observe_scale(KeyframeId keyframe, const ScaleOptions& options, const FeatureModel& features,
                          map::MapDraft& draft);

// Scales the submap of a keyframe as its matched features show (frame::StereoScale), if the map was not corrected since
// they were compared with it, and puts the landmarks that they created at their places again.
void apply_stereo_scale(KeyframeId keyframe, map::MapDraft& draft);

// Returns true if the map can be declared metric: this estimate and the previous one, whose deviation is
// `deviation_before`, are both accurate enough, and this estimate did not change the scale significantly.
bool is_metric(const ScaleReport& report, double deviation_before, const ScaleOptions& options);

}  // namespace bslam::mapping
