// Searches for landmarks in one keyframe. A match becomes an observation or, if the feature already has another
// landmark, the two landmarks are merged.
#pragma once

#include <vector>

#include "base/options.h"
#include "feature/feature_model.h"
#include "map/map_edit.h"

namespace bslam::mapping {

struct LandmarkFusionOptions {
  double radius = 0.006;    // rad, search radius about the projection
  int max_hamming = 50;     // bits, maximum descriptor distance
  double max_chi2 = 5.991;  // maximum squared normalised reprojection error of the keypoint

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("radius", self.radius, Range{1e-4, 1}, "rad", "search radius about the projection");
    visitor("max_hamming", self.max_hamming, Range{1, 256}, "bits", "maximum descriptor distance");
    visitor("max_chi2", self.max_chi2, Range{0.1, 1000}, "", "maximum squared normalised reprojection error");
  }
};

// Determines which of two merged landmarks is kept: the one with more observations, or the one searched for.
enum class Keep { kMoreObserved, kSearched };

// Searches for `landmarks` in every camera of `target`, projected with the rig pose `T_rig_world`. Landmarks that
// `target` already observes are skipped.
void fuse_into(KeyframeId target, const geometry::SE3& T_rig_world, const std::vector<LandmarkId>& landmarks, Keep keep,
               const LandmarkFusionOptions& options, const feature::FeatureModel& features, map::MapDraft& draft);
// The same with the pose of `target` in the draft.
void fuse_into(KeyframeId target, const std::vector<LandmarkId>& landmarks, Keep keep,
               const LandmarkFusionOptions& options, const feature::FeatureModel& features, map::MapDraft& draft);

}  // namespace bslam::mapping
