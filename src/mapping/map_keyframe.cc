#include "mapping/map_keyframe.h"

#include "mapping/create_landmarks.h"
#include "mapping/cull.h"
#include "mapping/local_adjustment.h"

namespace bslam::mapping {

MappingReport map_keyframe(KeyframeId keyframe, const MappingOptions& options, const FeatureModel& features,
                           map::MapDraft& draft, std::stop_token stop) {
  MappingReport report;
  report.culled_landmarks = cull_landmarks(keyframe, options.culling, draft);
  report.created = create_landmarks(keyframe, options.creation, features, draft);
  report.fusion = fuse_landmarks(keyframe, options.fusion, features, draft);
  report.adjustment = adjustment::adjust_map(select_local(draft.map(), keyframe, options.window), options.local,
                                             features.sigma_px, features.scale_factor, draft, stop);
  report.culled_keyframes = cull_keyframes(keyframe, options.culling, draft);
  return report;
}

adjustment::AdjustmentReport adjust_globally(const MappingOptions& options, const FeatureModel& features, map::MapDraft& draft,
                                             std::stop_token stop) {
  return adjustment::adjust_map(select_all(draft.map()), options.global, features.sigma_px, features.scale_factor, draft, stop);
}

}  // namespace bslam::mapping
