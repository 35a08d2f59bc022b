#include "tracking/frame_matches.h"

#include <algorithm>
#include <cmath>

#include "map/search_points.h"
#include "solver/reprojection.h"

namespace bslam::tracking {

using geometry::SE3;

std::size_t count(const FrameMatches& matches) {
  std::size_t n = 0;
  for (const auto& camera : matches) n += camera.size();
  return n;
}

namespace {

// Keypoints and landmarks that each camera has already matched, which are excluded from the search. The lookup is fast
// for landmarks in the leading part of `landmarks` that is sorted by id.
std::vector<matching::SearchExclusions> matched_already(const frame::BundledFrame& frame,
                                                        std::span<const LandmarkId> landmarks,
                                                        const FrameMatches& known) {
  const auto sorted_end = std::is_sorted_until(landmarks.begin(), landmarks.end());
  std::vector<matching::SearchExclusions> out(known.size());
  for (std::size_t c = 0; c < known.size(); ++c) {
    out[c].keypoints.resize(frame.cameras[c].keypoints.size());
    out[c].points.resize(landmarks.size());
    for (const Match& m : known[c]) {
      out[c].keypoints[m.keypoint.index()] = 1;
      auto at = std::lower_bound(landmarks.begin(), sorted_end, m.landmark);
      if (at == sorted_end || *at != m.landmark) at = std::find(sorted_end, landmarks.end(), m.landmark);
      if (at != landmarks.end()) out[c].points[static_cast<std::size_t>(at - landmarks.begin())] = 1;
    }
  }
  return out;
}

}  // namespace

MatchSearch find_landmarks(const map::BundledMap& map, const frame::BundledFrame& frame, const SE3& T_rig_world,
                           std::span<const LandmarkId> landmarks, const FrameMatches& known,
                           const matching::ProjectionSearchOptions& options, ThreadPool& pool) {
  const camera::Rig rig = frame::rig_of(map.rig(), frame);
  const auto results =
      matching::search_cameras(rig, frame, matching::camera_poses(rig, T_rig_world), map::search_points(map, landmarks),
                               matched_already(frame, landmarks, known), options, &pool);
  MatchSearch out;
  std::vector<std::uint8_t> visible(landmarks.size(), 0);
  for (const matching::ProjectionSearchResult& result : results) {
    std::vector<Match>& found = out.found.emplace_back();
    for (const matching::ProjectionMatch& m : result.matches) found.push_back({m.keypoint, landmarks[m.point]});
    std::sort(found.begin(), found.end(), [](const Match& a, const Match& b) { return a.keypoint < b.keypoint; });
    out.visible_by_camera.push_back(static_cast<int>(result.visible.size()));
    for (const std::uint32_t i : result.visible) visible[i] = 1;
  }
  for (std::size_t i = 0; i < visible.size(); ++i) {
    if (visible[i]) out.visible.push_back(landmarks[i]);
  }
  return out;
}

FrameMatches merge(const FrameMatches& a, const FrameMatches& b) {
  FrameMatches out(std::max(a.size(), b.size()));
  for (std::size_t c = 0; c < out.size(); ++c) {
    if (c < a.size()) out[c] = a[c];
    if (c < b.size()) out[c].insert(out[c].end(), b[c].begin(), b[c].end());
    std::sort(out[c].begin(), out[c].end(), [](const Match& p, const Match& q) { return p.keypoint < q.keypoint; });
  }
  return out;
}

std::optional<matching::AlignedKeypoint> align_landmark(const map::BundledMap& map, const camera::Rig& rig,
                                                        std::size_t c, const SE3& T_rig_world,
                                                        const image::Pyramid& pyramid, LandmarkId landmark,
                                                        const Eigen::Vector2d& initial,
                                                        const matching::AlignmentOptions& options) {
  const map::Landmark& l = map.landmark(landmark);
  const map::LandmarkReference& reference = l.reference;
  const feature::Keypoints& keypoints = map.keypoints(reference.keyframe, reference.keypoint.camera);
  const std::size_t k = reference.keypoint.keypoint.index();
  const feature::Patch* const patch = keypoints.patch.find(k);
  if (patch == nullptr) return std::nullopt;
  const SE3 T_ref_world = map.cam_from_world(reference.keyframe, reference.keypoint.camera);
  // A smaller image has fewer levels than the image of the reference may have had.
  const std::size_t level = keypoints.level[k];
  const double scale =
      level < pyramid.size() ? pyramid.scale_x[level] : map.pyramid().scale(static_cast<double>(level));
  const SE3 T_cam_ref = rig.cam_from_rig(c) * T_rig_world * T_ref_world.inverse();
  const auto warp = matching::patch_warp(map.rig().camera(reference.keypoint.camera), rig.camera(c), T_cam_ref,
                                         T_ref_world * l.position, scale);
  if (!warp) return std::nullopt;
  return matching::align_patch(*patch, *warp, pyramid, initial, options);
}

AlignedMatches align_matches(const map::BundledMap& map, const frame::BundledFrame& frame, const SE3& T_rig_world,
                             FrameMatches& matches, std::span<const image::Pyramid> pyramids,
                             std::span<const matching::AlignmentOptions> alignment,
                             const feature::FeatureModel& features, ThreadPool& pool) {
  const camera::Rig rig = frame::rig_of(map.rig(), frame);
  AlignedMatches out(matches.size());
  pool.for_each(matches.size(), [&](std::size_t c) {
    out[c].reserve(matches[c].size());
    const feature::Keypoints& keypoints = frame.cameras[c].keypoints;
    for (Match& m : matches[c]) {
      const std::size_t k = m.keypoint.index();
      const auto aligned = align_landmark(map, rig, c, T_rig_world, pyramids[c], m.landmark,
                                          keypoints.pixel[k].cast<double>(), alignment[c]);
      const auto bearing = aligned ? rig.camera(c).unproject(aligned->pixel) : std::nullopt;
      m.aligned = bearing.has_value();
      if (bearing) {
        out[c].push_back({aligned->pixel.cast<float>(), *bearing, static_cast<float>(aligned->sigma)});
      } else {
        const double sigma = features.sigma_px * pyramids[c].scale_x[keypoints.level[k]];
        out[c].push_back({keypoints.pixel[k], keypoints.bearing[k], static_cast<float>(sigma)});
      }
    }
  });
  return out;
}

frame::BundledFrame refined(const frame::BundledFrame& frame, const FrameMatches& matches,
                            const AlignedMatches& aligned, std::span<const std::uint8_t> inlier,
                            const camera::Rig& rig) {
  frame::BundledFrame out = frame;
  std::size_t observation = 0;
  for (std::size_t c = 0; c < matches.size(); ++c) {
    if (matches[c].empty()) continue;
    feature::Refinement positions = frame.cameras[c].keypoints.positions();
    for (std::size_t i = 0; i < matches[c].size(); ++i) {
      if (!inlier[observation++]) continue;
      const std::size_t k = matches[c][i].keypoint.index();
      positions.pixel[k] = aligned[c][i].pixel;
      positions.bearing[k] = aligned[c][i].bearing;
      positions.sigma[k] = aligned[c][i].sigma;
    }
    out.cameras[c] = frame::refined(out.cameras[c], std::move(positions), rig.camera(c));
  }
  return out;
}

std::vector<solver::PoseObservation> pose_observations(const map::BundledMap& map, const FrameMatches& matches,
                                                       const AlignedMatches& aligned) {
  std::vector<solver::PoseObservation> out;
  out.reserve(count(matches));
  for (std::size_t c = 0; c < matches.size(); ++c) {
    for (std::size_t i = 0; i < matches[c].size(); ++i) {
      const AlignedMatch& a = aligned[c][i];
      out.push_back(
          {CameraIndex(c), map.landmark(matches[c][i].landmark).position, a.pixel.cast<double>(), double{a.sigma}});
    }
  }
  return out;
}

std::vector<solver::PoseObservation> pose_observations(const map::BundledMap& map, const frame::BundledFrame& frame,
                                                       const FrameMatches& matches) {
  std::vector<solver::PoseObservation> out;
  for (std::size_t c = 0; c < matches.size(); ++c) {
    const feature::Keypoints& keypoints = frame.cameras[c].keypoints;
    for (const Match& m : matches[c]) {
      const std::size_t k = m.keypoint.index();
      out.push_back({CameraIndex(c), map.landmark(m.landmark).position, keypoints.pixel[k].cast<double>(),
                     static_cast<double>(keypoints.sigma[k])});
    }
  }
  return out;
}

std::vector<solver::PoseObservation> pose_observations(const map::BundledMap& map, const frame::BundledFrame& frame,
                                                       const FrameMatches& matches,
                                                       const feature::FeatureModel& features) {
  std::vector<solver::PoseObservation> out;
  out.reserve(count(matches));
  for (std::size_t c = 0; c < matches.size(); ++c) {
    const feature::Keypoints& keypoints = frame.cameras[c].keypoints;
    for (const Match& m : matches[c]) {
      const std::size_t k = m.keypoint.index();
      const double sigma = features.sigma(keypoints.level[k]);
      out.push_back({CameraIndex(c), map.landmark(m.landmark).position, keypoints.pixel[k].cast<double>(), sigma});
    }
  }
  return out;
}

std::vector<std::vector<std::optional<double>>> squared_errors(const map::BundledMap& map,
                                                               const frame::BundledFrame& frame,
                                                               const geometry::SE3& T_rig_world,
                                                               const FrameMatches& matches) {
  const camera::Rig rig = frame::rig_of(map.rig(), frame);
  std::vector<std::vector<std::optional<double>>> out(matches.size());
  for (std::size_t c = 0; c < matches.size(); ++c) {
    const geometry::SE3 T_cam_world = rig.cam_from_rig(c) * T_rig_world;
    for (const Match& m : matches[c]) {
      const Eigen::Vector2d pixel = frame.cameras[c].keypoints.pixel[m.keypoint.index()].cast<double>();
      const Eigen::Vector3d point = T_cam_world * map.landmark(m.landmark).position;
      const auto error = solver::residual_error(rig.camera(c).model, rig.shutter(c), point, pixel);
      out[c].push_back(error ? std::optional(error->squaredNorm()) : std::nullopt);
    }
  }
  return out;
}

FrameMatches keep_inliers(const FrameMatches& matches, std::span<const std::uint8_t> inlier) {
  FrameMatches out(matches.size());
  std::size_t i = 0;
  for (std::size_t c = 0; c < matches.size(); ++c) {
    for (const Match& m : matches[c]) {
      if (inlier[i++]) out[c].push_back(m);
    }
  }
  return out;
}

std::vector<LandmarkId> landmarks_of(const FrameMatches& matches) {
  std::vector<LandmarkId> ids;
  for (const auto& camera : matches) {
    for (const Match& m : camera) ids.push_back(m.landmark);
  }
  std::sort(ids.begin(), ids.end());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  return ids;
}

}  // namespace bslam::tracking
