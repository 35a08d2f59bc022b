#include "mapping/fuse_landmarks.h"

#include <algorithm>
#include <cmath>

#include "frame/projection_search.h"

namespace bslam::mapping {
namespace {

using geometry::SE3;

std::vector<KeyframeId> fusion_targets(const map::BundledMap& map, KeyframeId keyframe, const FusionOptions& options) {
  std::vector<KeyframeId> targets;
  const auto take = [&](KeyframeId k) {
    if (k == keyframe || targets.size() >= static_cast<std::size_t>(options.max_targets)) return;
    if (std::find(targets.begin(), targets.end(), k) == targets.end()) targets.push_back(k);
  };
  const auto first = map.best_covisible(keyframe, static_cast<std::size_t>(options.neighbours));
  for (const map::Covisible& c : first) take(c.keyframe);
  for (const map::Covisible& c : first) {
    for (const map::Covisible& d : map.best_covisible(c.keyframe, static_cast<std::size_t>(options.second_neighbours))) {
      take(d.keyframe);
    }
  }
  return targets;
}

std::vector<LandmarkId> landmarks_of(const map::BundledMap& map, KeyframeId k) {
  std::vector<LandmarkId> out;
  for (const LandmarkId l : map.keyframe(k).landmarks) {
    if (l.valid()) out.push_back(l);
  }
  std::sort(out.begin(), out.end());
  return out;
}

// The keypoint agrees with the landmark's projection.
bool agrees(const map::BundledMap& map, LandmarkId l, const camera::Camera& camera, const SE3& T_cam_world,
            const feature::Keypoints& keypoints, std::size_t k, const FusionOptions& options, const FeatureModel& features) {
  const auto pixel = camera.project(T_cam_world * map.landmark(l).position);
  if (!pixel) return false;
  const double sigma = features.sigma_px * std::pow(features.scale_factor, keypoints.level[k]);
  return (keypoints.pixel[k].cast<double>() - *pixel).squaredNorm() < options.max_chi2 * sigma * sigma;
}

// One landmark found at a feature of a keyframe: a new observation, or two landmarks that are one.
void join(LandmarkId l, KeyframeId target, FeatureId feature, map::MapDraft& draft, FusionReport& report) {
  const LandmarkId there = draft.map().landmark_of(target, feature);
  if (!there.valid()) {
    report.added += draft.add_observation(l, {target, feature, false});
  } else if (there != l) {
    const bool keep_there = draft.map().observations(there).size() > draft.map().observations(l).size();
    draft.merge_landmarks(keep_there ? l : there, keep_there ? there : l);
    ++report.merged;
  }
}

void fuse_into(KeyframeId target, const std::vector<LandmarkId>& landmarks, const FusionOptions& options,
               const FeatureModel& features, map::MapDraft& draft, FusionReport& report) {
  const camera::Rig& rig = draft.map().rig();
  const auto frame = draft.map().keyframe(target).frame;  // kept: edits may copy the keyframe
  const SE3 T_rig_world = draft.map().keyframe(target).T_rig_world;
  std::vector<LandmarkId> absent;
  const std::vector<LandmarkId> present = landmarks_of(draft.map(), target);
  for (const LandmarkId l : landmarks) {
    if (draft.map().alive(l) && !std::binary_search(present.begin(), present.end(), l)) absent.push_back(l);
  }
  std::vector<frame::SearchPoint> points(absent.size());
  std::vector<feature::Descriptor> descriptors(absent.size());
  for (std::size_t i = 0; i < absent.size(); ++i) {
    const map::Landmark& l = draft.map().landmark(absent[i]);
    descriptors[i] = l.descriptor;
    points[i] = {l.position, l.view_direction, l.min_distance, l.max_distance, &descriptors[i], 0};
  }
  const frame::ProjectionSearchOptions search{.radius = options.radius,
                                              .max_hamming = options.max_hamming,
                                              .ratio = 1.0,
                                              .scale_factor = features.scale_factor};
  for (std::size_t c = 0; c < rig.size(); ++c) {
    const SE3 T_cam_world = rig.cam_from_rig(c) * T_rig_world;
    const auto found = frame::search_by_projection(rig.camera(c), frame->cameras[c], T_cam_world, points, {}, search);
    for (const frame::ProjectionMatch& m : found.matches) {
      const LandmarkId l = draft.map().resolve(absent[m.point]);
      if (!l.valid()) continue;
      const feature::Keypoints& keypoints = frame->cameras[c].keypoints;
      if (!agrees(draft.map(), l, rig.camera(c), T_cam_world, keypoints, m.keypoint.index(), options, features)) continue;
      join(l, target, frame->bundled.feature(CameraIndex(c), m.keypoint), draft, report);
    }
  }
}

}  // namespace

FusionReport fuse_landmarks(KeyframeId keyframe, const FusionOptions& options, const FeatureModel& features, map::MapDraft& draft) {
  FusionReport report;
  const std::vector<KeyframeId> targets = fusion_targets(draft.map(), keyframe, options);
  for (const KeyframeId target : targets) {
    fuse_into(target, landmarks_of(draft.map(), keyframe), options, features, draft, report);
  }
  std::vector<LandmarkId> theirs;
  for (const KeyframeId target : targets) {
    const std::vector<LandmarkId> some = landmarks_of(draft.map(), target);
    theirs.insert(theirs.end(), some.begin(), some.end());
  }
  std::sort(theirs.begin(), theirs.end());
  theirs.erase(std::unique(theirs.begin(), theirs.end()), theirs.end());
  fuse_into(keyframe, theirs, options, features, draft, report);
  draft.refresh_landmarks(landmarks_of(draft.map(), keyframe));
  return report;
}

}  // namespace bslam::mapping
