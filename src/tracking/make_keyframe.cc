#include "tracking/make_keyframe.h"

#include <algorithm>
#include <map>

#include "feature/window.h"
#include "matching/bundling.h"

namespace bslam::tracking {
namespace {

using frame::BundledFrame;
using frame::KeypointRef;

// Landmark of every keypoint of every camera; invalid = none.
using LandmarkTable = std::vector<std::vector<LandmarkId>>;

LandmarkTable landmark_table(const BundledFrame& frame, const FrameMatches& matches) {
  LandmarkTable table;
  for (const frame::CameraFrame& c : frame.cameras) table.emplace_back(c.keypoints.size(), LandmarkId());
  for (std::size_t c = 0; c < matches.size(); ++c) {
    for (const Match& m : matches[c]) table[c][m.keypoint.index()] = m.landmark;
  }
  return table;
}

bool has_camera(const std::vector<KeypointRef>& group, CameraIndex camera) {
  return std::any_of(group.begin(), group.end(), [&](const KeypointRef& r) { return r.camera == camera; });
}

using Groups = std::vector<std::vector<KeypointRef>>;  // of two or more keypoints

using KeypointsByLandmark = std::map<LandmarkId, std::vector<KeypointRef>>;

KeypointsByLandmark keypoints_by_landmark(const LandmarkTable& table) {
  KeypointsByLandmark out;
  for (std::size_t c = 0; c < table.size(); ++c) {
    for (std::size_t k = 0; k < table[c].size(); ++k) {
      if (table[c][k].valid()) out[table[c][k]].push_back({CameraIndex(c), KeypointIndex(k)});
    }
  }
  return out;
}

// Landmarks of the keypoints of a bundled feature.
struct FeatureContent {
  std::vector<KeypointRef> free;  // its keypoints without a landmark
  LandmarkId owner;               // the landmark of the other keypoints; invalid if there are none
  bool ambiguous = false;         // the other keypoints are matched to several landmarks
};

FeatureContent content_of(std::span<const KeypointRef> keypoints, const LandmarkTable& table) {
  FeatureContent out;
  for (const KeypointRef r : keypoints) {
    const LandmarkId l = table[r.camera.index()][r.keypoint.index()];
    if (!l.valid()) {
      out.free.push_back(r);
    } else {
      out.ambiguous |= out.owner.valid() && out.owner != l;
      out.owner = l;
    }
  }
  return out;
}

// Keypoints matched to the same landmark become one feature. A bundled keypoint without a landmark is added to the
// feature of the landmark it was bundled with if that landmark has no keypoint in its camera yet and projects onto it.
Groups regroup(const BundledFrame& frame, const LandmarkTable& table, const camera::Rig& rig,
               const map::BundledMap& map, const geometry::SE3& T_rig_world) {
  const auto agrees = [&](KeypointRef r, LandmarkId l) {
    const feature::Keypoints& keypoints = frame.keypoints(r.camera);
    const std::size_t k = r.keypoint.index();
    const auto error = solver::ReprojectionResidual::error_only(rig, r.camera, T_rig_world, map.landmark(l).position,
                                                                keypoints.pixel[k].cast<double>());
    return error && error->squaredNorm() <= solver::kChi2TwoDof95 * keypoints.sigma[k] * keypoints.sigma[k];
  };
  KeypointsByLandmark by_landmark = keypoints_by_landmark(table);
  Groups groups;
  for (std::size_t f = 0; f < frame.bundled.num_matched(); ++f) {
    const FeatureContent feature = content_of(frame.bundled.keypoints(FeatureId(f)), table);
    if (!feature.owner.valid() && feature.free.size() >= 2) {
      groups.push_back(feature.free);
    } else if (feature.owner.valid() && !feature.ambiguous) {
      std::vector<KeypointRef>& known = by_landmark[feature.owner];
      for (const KeypointRef r : feature.free) {
        if (!has_camera(known, r.camera) && agrees(r, feature.owner)) known.push_back(r);
      }
    }
  }
  for (auto& [landmark, keypoints] : by_landmark) {
    if (keypoints.size() < 2) continue;
    std::sort(keypoints.begin(), keypoints.end());
    groups.push_back(keypoints);
  }
  return groups;
}

// The patch of keypoint `k` at its refined pixel, or its original patch if that pixel is too close to the border.
feature::Patch patch_at_pixel(const image::Pyramid& pyramid, const feature::Keypoints& keypoints, std::size_t k) {
  constexpr double kMargin = feature::kPatchSize / 2 + 1;
  const std::size_t level = keypoints.level[k];
  const image::Image& image = pyramid.levels[level];
  const double x = pyramid.from_base_x(level, keypoints.pixel[k].x()),
               y = pyramid.from_base_y(level, keypoints.pixel[k].y());
  if (x < kMargin || y < kMargin || x > image.width() - 1 - kMargin || y > image.height() - 1 - kMargin) {
    return keypoints.patch[k];
  }
  return feature::sample_patch(image.view(), static_cast<float>(x), static_cast<float>(y));
}

// The frame that is stored in the map: patches are sampled at the refined keypoints, and the table contains `groups`.
std::shared_ptr<const BundledFrame> keyframe_of(const BundledFrame& frame, const Groups& groups, const camera::Rig& rig,
                                                std::span<const image::Pyramid> pyramids,
                                                const InitialisationOptions& options) {
  auto out = std::make_shared<BundledFrame>(frame);
  for (std::size_t c = 0; c < out->cameras.size(); ++c) {
    feature::Keypoints& keypoints = out->cameras[c].keypoints;
    std::vector<feature::Patch> patches(keypoints.size());
    for (std::size_t k = 0; k < patches.size(); ++k) patches[k] = patch_at_pixel(pyramids[c], keypoints, k);
    keypoints.patch = std::move(patches);
  }
  out->bundled = matching::make_bundled(rig, out->cameras, groups, options.min_parallax, options.max_chi2);
  return out;
}

}  // namespace

bool has_accurate_depth(const std::optional<frame::BundledPoint>& point, const InitialisationOptions& options) {
  if (!point) return false;
  const Eigen::Vector3d ray = point->point_rig.normalized();
  return std::sqrt(ray.dot(point->covariance * ray)) <= options.max_depth_error * point->point_rig.norm();
}

NewKeyframe make_keyframe(const BundledFrame& frame, const FrameMatches& matches, const geometry::SE3& T_rig_world,
                          std::span<const image::Pyramid> pyramids, KeyframeId reference,
                          const InitialisationOptions& options, map::MapDraft& draft) {
  const camera::Rig rig = frame::rig_of(draft.map().rig(), frame);
  const LandmarkTable table = landmark_table(frame, matches);
  const Groups groups = regroup(frame, table, rig, draft.map(), T_rig_world);
  const std::shared_ptr<const BundledFrame> stored = keyframe_of(frame, groups, rig, pyramids, options);

  std::vector<std::pair<FeatureId, LandmarkId>> observed;
  std::vector<std::uint8_t> has_landmark(stored->bundled.size(), 0);
  NewKeyframe out;
  for (std::size_t c = 0; c < table.size(); ++c) {
    for (std::size_t k = 0; k < table[c].size(); ++k) {
      if (!table[c][k].valid()) continue;
      const FeatureId f = stored->bundled.feature(CameraIndex(c), KeypointIndex(k));
      if (std::exchange(has_landmark[f.index()], std::uint8_t{1})) continue;
      observed.emplace_back(f, table[c][k]);
      out.landmarks.push_back(table[c][k]);
    }
  }
  out.keyframe = draft.add_keyframe(stored, T_rig_world, std::move(observed), reference);

  const geometry::SE3 T_world_rig = T_rig_world.inverse();
  for (std::size_t f = 0; f < stored->bundled.num_matched(); ++f) {
    const FeatureId feature(f);
    const auto& point = stored->bundled.point(feature);
    if (has_landmark[f] || !has_accurate_depth(point, options)) continue;
    const KeypointRef first = stored->bundled.keypoints(feature).front();
    out.landmarks.push_back(
        draft.add_landmark(T_world_rig * point->point_rig, {{out.keyframe, feature}}, {out.keyframe, first}));
  }
  std::vector<LandmarkId> seen_again = out.landmarks;
  draft.refresh_landmarks(std::move(seen_again));
  std::sort(out.landmarks.begin(), out.landmarks.end());
  return out;
}

}  // namespace bslam::tracking
