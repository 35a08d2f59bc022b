#include "mapping/map_keyframe.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "mapping/create_landmarks.h"
#include "mapping/cull.h"
#include "mapping/local_adjustment.h"
#include "mapping/unknown_motion.h"

namespace bslam::mapping {
namespace {

constexpr double kMaxOtherDeviation = 0.1;  // see max_deviation_of_others

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

// Maximum deviation of the scales of a metric map's older submaps, which may be too short for an accurate one.
double max_deviation_of_others(const ScaleOptions& options) {
  return std::max(kMaxOtherDeviation, options.max_deviation);
}

// Estimates the scales of all submaps but that of the keyframe, if all are accurate enough. Returns the largest of
// their deviations, 0 if there are no other submaps, and infinity if some scale is not.
double scale_others(KeyframeId keyframe, const Mapping& mapping, map::MapDraft& draft) {
  std::vector<KeyframeId> newest;  // of each submap
  for (const KeyframeId root : draft.map().roots()) {
    if (root != draft.map().root_of(keyframe))
      newest.push_back(std::ranges::max(draft.map().keyframes_of_submap(root)));
  }
  const auto is_accurate = [&](KeyframeId k) {
    map::MapDraft trial = draft;
    const ScaleReport scale = observe_scale(k, mapping.options.scale, mapping.features, trial);
    return scale.observed && scale.deviation <= max_deviation_of_others(mapping.options.scale);
  };
  if (!std::ranges::all_of(newest, is_accurate)) return std::numeric_limits<double>::infinity();
  double deviation = 0;
  for (const KeyframeId k : newest) deviation = std::max(deviation, adjust_with_scale(k, mapping, draft).deviation);
  return deviation;
}

void adjust_locally(KeyframeId keyframe, const Mapping& mapping, map::MapDraft& draft) {
  // One estimate that contradicts a metric scale is not enough to make another one metric.
  const bool metric = draft.map().scale() == map::Scale::kMetric;
  const double deviation_before = metric ? std::numeric_limits<double>::infinity() : draft.map().scale_deviation();
  const ScaleReport scale = adjust_with_scale(keyframe, mapping, draft);
  if (!is_metric(scale, deviation_before, mapping.options.scale)) return;
  const double of_others = scale_others(keyframe, mapping, draft);  // the scale is a property of the whole map
  const bool known = of_others <= max_deviation_of_others(mapping.options.scale);
  draft.set_scale(known ? map::Scale::kMetric : map::Scale::kUnobservable,
                  known ? std::max(scale.deviation, of_others) : scale.deviation);
}

}  // namespace

void map_keyframe(KeyframeId keyframe, const MappingOptions& options, const FeatureModel& features,
                  map::MapDraft& draft, std::stop_token stop, std::shared_ptr<const Eigen::MatrixXd> rig_prior) {
  complete_motion_of_root(keyframe, draft);
  apply_stereo_scale(keyframe, draft);
  cull_landmarks(keyframe, options.culling, draft);
  create_landmarks(keyframe, options.creation, features, draft);
  fuse_landmarks(keyframe, options.fusion, features, draft);
  adjust_locally(keyframe, {options, features, rig_prior, stop}, draft);
  cull_keyframes(keyframe, options.culling, draft);
}

bool adjust_globally(const MappingOptions& options, const FeatureModel& features, map::MapDraft& draft,
                     std::stop_token stop) {
  return adjustment::adjust_map(select_all(draft.map()), options.global, features, draft, stop);
}

}  // namespace bslam::mapping
