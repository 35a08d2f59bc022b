#include "mapping/map_keyframe.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "mapping/create_landmarks.h"
#include "mapping/cull.h"
#include "mapping/local_adjustment.h"
#include "mapping/unknown_motion.h"

namespace bslam::mapping {
namespace {

// Maximum relative standard deviation of the scales of a metric map's older submaps.
constexpr double kMaxOtherDeviation = 0.1;

// What map_keyframe() passes to its steps.
struct Mapping {
  const MappingOptions& options;
  const FeatureModel& features;
  const std::shared_ptr<const Eigen::MatrixXd>& rig_prior;
  const std::stop_token& stop;
};

// A scale correction leaves the observations of other cameras inconsistent; the adjustment repairs this, and the next
// measurement of the scale starts from its result.
ScaleReport adjust_with_scale(KeyframeId keyframe, const Mapping& mapping, map::MapDraft& draft) {
  const auto& [options, features, rig_prior, stop] = mapping;
  ScaleReport scale;
  for (int round = 0; round < options.scale.rounds; ++round) {
    scale = observe_scale(keyframe, options.scale, features, draft);
    adjustment::Selection selection = needs_whole_submap(draft.map(), keyframe, options.scale)
                                          ? select_submap(draft.map(), keyframe)
                                          : select_local(draft.map(), keyframe, options.window);
    selection.rig_prior = rig_prior;
    adjustment::adjust_map(selection, options.local, features, draft, stop);
    if (std::abs(scale.correction - 1.0) <= options.scale.converged_change || stop.stop_requested()) break;
  }
  return scale;
}

// Estimates the scales of all submaps but that of the keyframe. Returns the largest of their deviations, 0 if there are
// no other submaps, and infinity if some scale is not observable.
double scale_others(KeyframeId keyframe, const Mapping& mapping, map::MapDraft& draft) {
  double deviation = 0;
  for (const KeyframeId root : draft.map().roots()) {
    if (root == draft.map().root_of(keyframe)) continue;
    const ScaleReport scale =
        adjust_with_scale(std::ranges::max(draft.map().keyframes_of_submap(root)), mapping, draft);
    deviation = std::max(deviation, scale.observed ? scale.deviation : std::numeric_limits<double>::infinity());
  }
  return deviation;
}

void adjust_locally(KeyframeId keyframe, const Mapping& mapping, map::MapDraft& draft) {
  // One estimate that contradicts a metric scale is not enough to make another one metric.
  const bool metric = draft.map().scale() == map::Scale::kMetric;
  const double deviation_before = metric ? std::numeric_limits<double>::infinity() : draft.map().scale_deviation();
  const ScaleReport scale = adjust_with_scale(keyframe, mapping, draft);
  if (!is_metric(scale, deviation_before, mapping.options.scale)) return;
  // The scale is a property of the whole map. Other submaps may be too short for an accurate one.
  const double of_others = scale_others(keyframe, mapping, draft);
  const bool known = of_others <= std::max(kMaxOtherDeviation, mapping.options.scale.max_deviation);
  draft.set_scale(known ? map::Scale::kMetric : map::Scale::kUnobservable,
                  known ? std::max(scale.deviation, of_others) : scale.deviation);
}

}  // namespace

void map_keyframe(KeyframeId keyframe, const MappingOptions& options, const FeatureModel& features,
                  map::MapDraft& draft, std::stop_token stop, std::shared_ptr<const Eigen::MatrixXd> rig_prior) {
  complete_motion_of_root(keyframe, draft);
  cull_landmarks(keyframe, options.culling, draft);
  create_landmarks(keyframe, options.creation, features, draft);
  fuse_landmarks(keyframe, options.fusion, features, draft);
  adjust_locally(keyframe, {options, features, rig_prior, stop}, draft);
  cull_keyframes(keyframe, options.culling, draft);
}

adjustment::AdjustmentReport adjust_globally(const MappingOptions& options, const FeatureModel& features,
                                             map::MapDraft& draft, std::stop_token stop) {
  return adjustment::adjust_map(select_all(draft.map()), options.global, features, draft, stop);
}

}  // namespace bslam::mapping
