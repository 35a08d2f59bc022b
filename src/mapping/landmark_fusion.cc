#include "mapping/landmark_fusion.h"

#include <algorithm>

#include "map/keyframe_landmarks.h"
#include "map/search_points.h"
#include "matching/projection_search.h"
#include "solver/reprojection.h"

namespace bslam::mapping {
namespace {

using geometry::SE3;

// Returns true if the keypoint is close enough to the projection of the landmark.
bool agrees(const map::BundledMap& map, LandmarkId l, const camera::Rig& rig, std::size_t c, const SE3& T_cam_world,
            const feature::Keypoints& keypoints, std::size_t k, const LandmarkFusionOptions& options,
            const feature::FeatureModel& features) {
  const auto error = solver::residual_error(rig.camera(c).model, rig.shutter(c), T_cam_world * map.landmark(l).position,
                                            keypoints.pixel[k].cast<double>());
  const double sigma = features.sigma(keypoints.level[k]);
  return error && error->squaredNorm() < options.max_chi2 * sigma * sigma;
}

// Adds the feature as an observation of landmark l or, if the feature already has another landmark, merges the two.
void join(LandmarkId l, KeyframeId target, FeatureId feature, Keep keep, map::MapDraft& draft) {
  const LandmarkId existing = draft.map().landmark_of(target, feature);
  if (!existing.valid()) {
    draft.add_observation(l, {target, feature, false});
  } else if (existing != l) {
    const bool keep_existing =
        keep == Keep::kMoreObserved && draft.map().observations(existing).size() > draft.map().observations(l).size();
    draft.merge_landmarks(keep_existing ? l : existing, keep_existing ? existing : l);
  }
}

// Returns the elements of `landmarks` that are alive and not observed by `target`.
std::vector<LandmarkId> absent_from(const map::BundledMap& map, KeyframeId target,
                                    const std::vector<LandmarkId>& landmarks) {
  const std::vector<LandmarkId> present = landmarks_of(map, target);
  std::vector<LandmarkId> absent;
  for (const LandmarkId l : landmarks) {
    if (map.alive(l) && !std::binary_search(present.begin(), present.end(), l)) absent.push_back(l);
  }
  return absent;
}

}  // namespace

void fuse_into(KeyframeId target, const std::vector<LandmarkId>& landmarks, Keep keep,
               const LandmarkFusionOptions& options, const feature::FeatureModel& features, map::MapDraft& draft) {
  const SE3 T_rig_world = draft.map().keyframe(target).T_rig_world;
  fuse_into(target, T_rig_world, landmarks, keep, options, features, draft);
}

void fuse_into(KeyframeId target, const SE3& T_rig_world, const std::vector<LandmarkId>& landmarks, Keep keep,
               const LandmarkFusionOptions& options, const feature::FeatureModel& features, map::MapDraft& draft) {
  const auto frame = draft.map().keyframe(target).frame;  // shared ownership, because edits may copy the keyframe
  const camera::Rig rig = draft.map().rig_of(target);
  const std::vector<LandmarkId> absent = absent_from(draft.map(), target, landmarks);
  const matching::ProjectionSearchOptions search{.radius = options.radius,
                                                 .max_hamming = options.max_hamming,
                                                 .ratio = 1.0,
                                                 .scale_factor = features.pyramid.scale_factor};
  const std::vector<SE3> T_cam_world = matching::camera_poses(rig, T_rig_world);
  const auto results =
      matching::search_cameras(rig, *frame, T_cam_world, map::search_points(draft.map(), absent), {}, search);
  for (std::size_t c = 0; c < results.size(); ++c) {
    for (const matching::ProjectionMatch& m : results[c].matches) {
      const LandmarkId l = draft.map().resolve(absent[m.point]);
      if (!l.valid()) continue;
      const feature::Keypoints& keypoints = frame->cameras[c].keypoints;
      if (!agrees(draft.map(), l, rig, c, T_cam_world[c], keypoints, m.keypoint.index(), options, features)) continue;
      join(l, target, frame->bundled.feature(CameraIndex(c), m.keypoint), keep, draft);
    }
  }
}

}  // namespace bslam::mapping
