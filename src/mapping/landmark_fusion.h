// Searches for landmarks in one keyframe. A match becomes an observation or, where the keypoint shows another landmark,
// the two landmarks are merged.
#pragma once

#include <vector>

#include "base/options.h"
#include "feature/feature_model.h"
#include "map/map_edit.h"

namespace bslam::mapping {

struct LandmarkFusionOptions {
  double radius = 0.006;    // rad about the projection
  int max_hamming = 50;     // bits
  double max_chi2 = 5.991;  // squared normalised error of the keypoint against the landmark

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("radius", self.radius, Range{1e-4, 1}, "rad", "search radius about the projection");
    visitor("max_hamming", self.max_hamming, Range{1, 256}, "bits", "largest descriptor distance");
    visitor("max_chi2", self.max_chi2, Range{0.1, 1000}, "", "squared normalised error against the landmark");
  }
};

struct FusionReport {
  int added = 0;   // observations
  int merged = 0;  // landmarks

  FusionReport& operator+=(const FusionReport& other) {
    added += other.added;
    merged += other.merged;
    return *this;
  }
};

// Which of two merged landmarks keeps its position.
enum class Keep { kMoreObserved, kSearched };

// Looks for `landmarks` in every camera of `target` as if that were at `T_rig_world`. Those it observes already are
// left out.
FusionReport fuse_into(KeyframeId target, const geometry::SE3& T_rig_world, const std::vector<LandmarkId>& landmarks,
                       Keep keep, const LandmarkFusionOptions& options, const feature::FeatureModel& features,
                       map::MapDraft& draft);
// The same at its pose in the draft.
FusionReport fuse_into(KeyframeId target, const std::vector<LandmarkId>& landmarks, Keep keep,
                       const LandmarkFusionOptions& options, const feature::FeatureModel& features,
                       map::MapDraft& draft);

// The landmarks a keyframe observes, in order of id.
std::vector<LandmarkId> landmarks_of(const map::BundledMap& map, KeyframeId k);

}  // namespace bslam::mapping
