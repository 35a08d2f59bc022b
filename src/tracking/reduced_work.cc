#include "tracking/reduced_work.h"

#include <array>
#include <cmath>

namespace bslam::tracking {
namespace {

int times(int count, double share) { return static_cast<int>(std::lround(count * share)); }

}  // namespace

double work_share(int level) {
  constexpr std::array<double, kMaxReduction + 1> kShares = {1.0, 0.7, 0.5, 0.35};
  return kShares.at(static_cast<std::size_t>(level));
}

feature::FeatureOptions reduced(feature::FeatureOptions options, int level) {
  options.per_image = times(options.per_image, work_share(level));
  options.per_rig = times(options.per_rig, work_share(level));
  return options;
}

TrackingOptions reduced(TrackingOptions options, int level) {
  const double share = work_share(level);
  for (int* count : {&options.direct.per_image, &options.direct.per_rig, &options.direct.min_per_image,
                     &options.direct.coarse_per_image, &options.keyframe.min_camera_inliers,
                     &options.keyframe.min_tracked_close, &options.keyframe.max_untracked_close}) {
    *count = times(*count, share);
  }
  options.keyframe.min_interval = times(options.keyframe.min_interval, 1 / share);
  const double overlap = 0.5 * (1 + share);  // how long a keyframe remains the reference is less critical than counts
  options.keyframe.min_overlap *= overlap;
  options.direct.min_overlap *= overlap;
  return options;
}

void change_level(int from, int to, TrackerState& state) {
  if (to <= from) return;
  const double share = work_share(to) / work_share(from);
  for (CameraReference& r : state.references) {
    r.best_overlap = times(r.best_overlap, share);
    r.best_own_overlap = times(r.best_own_overlap, share);
    r.best_direct_overlap = times(r.best_direct_overlap, share);
  }
  for (int& best : state.direct.best_inliers) best = times(best, share);
}

}  // namespace bslam::tracking
