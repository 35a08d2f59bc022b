// The metric scale of a map that started without: what the rig's motion has told so far.
#pragma once

#include <limits>

#include "map/map_edit.h"
#include "mapping/options.h"

namespace bslam::mapping {

struct ScaleReport {
  bool observed = false;   // the images tell something
  double correction = 1;   // by which the part was scaled in the draft
  double deviation = std::numeric_limits<double>::infinity();  // relative standard deviation of the map's unit
  int keyframes = 0;       // that told
};

// Where the draft's map is unobservable: measures the length of its unit by `keyframe` and its best covisible keyframes,
// scales the part of the map they belong to by it, and writes the deviation to the draft. Nothing to do elsewhere.
ScaleReport observe_scale(KeyframeId keyframe, const ScaleOptions& options, const FeatureModel& features, map::MapDraft& draft);

// May the map call itself metric? Where this measurement and the one of the keyframe before, whose deviation the map had,
// are both certain enough, and this one left the map as long as it was.
bool is_metric(const ScaleReport& report, double deviation_before, const ScaleOptions& options);

}  // namespace bslam::mapping
