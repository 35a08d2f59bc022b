#include "mapping/map_keyframe.h"

#include <cmath>
#include <limits>

#include "mapping/create_landmarks.h"
#include "mapping/cull.h"
#include "mapping/local_adjustment.h"
#include "mapping/unknown_motion.h"

namespace bslam::mapping {
namespace {

// A scale correction leaves the observations of other cameras inconsistent; the adjustment repairs this, and the next
// measurement of the scale starts from its result.
void adjust_locally(KeyframeId keyframe, const MappingOptions& options, const FeatureModel& features,
                    const std::shared_ptr<const Eigen::MatrixXd>& rig_prior, map::MapDraft& draft,
                    const std::stop_token& stop) {
  // One estimate that contradicts a metric scale is not enough to make another one metric.
  const bool metric = draft.map().scale() == map::Scale::kMetric;
  const double deviation_before = metric ? std::numeric_limits<double>::infinity() : draft.map().scale_deviation();
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
  const bool single_submap = draft.map().roots().size() == 1;  // the scale is a property of the whole map
  if (single_submap && is_metric(scale, deviation_before, options.scale))
    draft.set_scale(map::Scale::kMetric, scale.deviation);
}

}  // namespace

void map_keyframe(KeyframeId keyframe, const MappingOptions& options, const FeatureModel& features,
                  map::MapDraft& draft, std::stop_token stop, std::shared_ptr<const Eigen::MatrixXd> rig_prior) {
  complete_motion_of_root(keyframe, draft);
  cull_landmarks(keyframe, options.culling, draft);
  create_landmarks(keyframe, options.creation, features, draft);
  fuse_landmarks(keyframe, options.fusion, features, draft);
  adjust_locally(keyframe, options, features, rig_prior, draft, stop);
  cull_keyframes(keyframe, options.culling, draft);
}

adjustment::AdjustmentReport adjust_globally(const MappingOptions& options, const FeatureModel& features,
                                             map::MapDraft& draft, std::stop_token stop) {
  return adjustment::adjust_map(select_all(draft.map()), options.global, features, draft, stop);
}

}  // namespace bslam::mapping
