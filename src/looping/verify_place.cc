#include "looping/verify_place.h"

#include <algorithm>

#include "feature/descriptor_matching.h"
#include "map/search_points.h"
#include "matching/projection_search.h"
#include "solver/pose_solver.h"

namespace bslam::looping {
namespace {

using frame::KeypointRef;
using geometry::SE3;

struct KeypointMatch {
  KeypointRef keypoint;
  LandmarkId landmark;
};

// Returns the descriptor of each unique feature of a frame, which is the descriptor of its first keypoint.
std::vector<feature::Descriptor> feature_descriptors(const frame::BundledFrame& frame) {
  std::vector<feature::Descriptor> out(frame.bundled.size());
  for (std::size_t f = 0; f < out.size(); ++f) {
    const KeypointRef r = frame.bundled.keypoints(FeatureId(f)).front();
    out[f] = frame.keypoints(r.camera).descriptor[r.keypoint.index()];
  }
  return out;
}

// Matches by appearance only. Ambiguous matches are discarded, and if several landmarks match one feature, the nearest
// one is kept.
std::vector<KeypointMatch> match_descriptors(const map::BundledMap& map, const frame::BundledFrame& frame,
                                             const std::vector<LandmarkId>& landmarks,
                                             const VerificationOptions& options) {
  const std::vector<feature::Descriptor> descriptors = feature_descriptors(frame);
  struct Choice {
    LandmarkId landmark;
    int distance = 257;
  };
  std::vector<Choice> of_feature(descriptors.size());
  for (const LandmarkId l : landmarks) {
    const feature::NearestDescriptor n =
        feature::nearest_descriptor(map.landmark(l).descriptor, descriptors, [](std::size_t) { return true; });
    if (!n.is_clear(options.max_hamming, options.ratio)) continue;
    if (n.distance < of_feature[n.index].distance) of_feature[n.index] = {l, n.distance};
  }
  std::vector<KeypointMatch> out;
  for (std::size_t f = 0; f < of_feature.size(); ++f) {
    if (!of_feature[f].landmark.valid()) continue;
    for (const KeypointRef r : frame.bundled.keypoints(FeatureId(f))) out.push_back({r, of_feature[f].landmark});
  }
  return out;
}

std::vector<solver::PoseObservation> observations_of(const map::BundledMap& map, const frame::BundledFrame& frame,
                                                     const std::vector<KeypointMatch>& matches,
                                                     const feature::FeatureModel& features) {
  std::vector<solver::PoseObservation> out;
  out.reserve(matches.size());
  for (const KeypointMatch& m : matches) {
    const feature::Keypoints& keypoints = frame.keypoints(m.keypoint.camera);
    const std::size_t k = m.keypoint.keypoint.index();
    out.push_back({m.keypoint.camera, map.landmark(m.landmark).position, keypoints.pixel[k].cast<double>(),
                   features.sigma(keypoints.level[k])});
  }
  return out;
}

// The landmarks of a place and their positions as search points.
struct PlaceLandmarks {
  std::vector<LandmarkId> landmarks;
  std::vector<matching::SearchPoint> points;  // one per landmark
};

// Searches for all landmarks at their projections with the given pose. `rig` has the camera poses at the capture times
// of the frame.
std::vector<KeypointMatch> search_at(const camera::Rig& rig, const frame::BundledFrame& frame,
                                     const PlaceLandmarks& place, const SE3& T_rig_world, double radius,
                                     const VerificationOptions& options, const feature::FeatureModel& features) {
  const matching::ProjectionSearchOptions search{.radius = radius,
                                                 .max_hamming = options.max_hamming,
                                                 .ratio = 1.0,
                                                 .level_slack = 2,
                                                 .scale_factor = features.pyramid.scale_factor};
  const auto results =
      matching::search_cameras(rig, frame, matching::camera_poses(rig, T_rig_world), place.points, {}, search);
  std::vector<KeypointMatch> out;
  for (std::size_t c = 0; c < results.size(); ++c) {
    for (const matching::ProjectionMatch& m : results[c].matches)
      out.push_back({{CameraIndex(c), m.keypoint}, place.landmarks[m.point]});
  }
  return out;
}

// Returns the landmarks predicted visible in any camera within `max_viewing_angle` of a known viewing direction, in
// order of id. From such a direction a landmark looks the same; from others it may not, and a missing match is no
// evidence against the place.
std::vector<LandmarkId> expected_landmarks(const camera::Rig& rig, const frame::BundledFrame& frame,
                                           const PlaceLandmarks& place, const SE3& T_rig_world,
                                           double max_viewing_angle) {
  std::vector<LandmarkId> out;
  for (std::size_t c = 0; c < rig.size(); ++c) {
    if (frame.cameras[c].keypoints.empty()) continue;
    for (const auto& visible : matching::visible_points(rig, CameraIndex(c), rig.cam_from_rig(c) * T_rig_world,
                                                        place.points, max_viewing_angle)) {
      out.push_back(place.landmarks[visible.point]);
    }
  }
  std::sort(out.begin(), out.end());
  out.erase(std::unique(out.begin(), out.end()), out.end());
  return out;
}

// Returns the inliers by feature. If cameras disagree about the landmark of a feature, the first camera is used.
std::vector<std::pair<FeatureId, LandmarkId>> by_feature(const frame::BundledFrame& frame,
                                                         const std::vector<KeypointMatch>& matches,
                                                         const std::vector<std::uint8_t>& inlier) {
  std::vector<std::pair<FeatureId, LandmarkId>> all;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (inlier[i]) all.emplace_back(frame.bundled.feature(matches[i].keypoint), matches[i].landmark);
  }
  std::stable_sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<LandmarkId> taken;
  std::vector<std::pair<FeatureId, LandmarkId>> out;
  for (const auto& m : all) {
    if (!out.empty() && out.back().first == m.first) continue;
    const auto at = std::lower_bound(taken.begin(), taken.end(), m.second);
    if (at != taken.end() && *at == m.second) continue;
    taken.insert(at, m.second);
    out.push_back(m);
  }
  return out;
}

}  // namespace

std::vector<LandmarkId> landmarks_around(const map::BundledMap& map, KeyframeId keyframe, int neighbours, int limit) {
  std::vector<KeyframeId> keyframes = {keyframe};
  for (const map::Covisible& c : map.best_covisible(keyframe, static_cast<std::size_t>(neighbours)))
    keyframes.push_back(c.keyframe);
  std::vector<LandmarkId> out;
  for (const KeyframeId k : keyframes) {
    for (const LandmarkId l : map.keyframe(k).landmarks) {
      if (l.valid()) out.push_back(l);
    }
  }
  std::sort(out.begin(), out.end());
  out.erase(std::unique(out.begin(), out.end()), out.end());
  std::stable_sort(out.begin(), out.end(),
                   [&](LandmarkId a, LandmarkId b) { return map.observations(a).size() > map.observations(b).size(); });
  if (out.size() > static_cast<std::size_t>(limit)) out.resize(static_cast<std::size_t>(limit));
  return out;
}

std::optional<PlaceMatch> verify_place(const map::BundledMap& map, const camera::Rig& rig,
                                       const frame::BundledFrame& frame, KeyframeId candidate,
                                       const VerificationOptions& options, const feature::FeatureModel& features,
                                       Random random, VerificationReport* report) {
  VerificationReport unused;
  VerificationReport& out = report != nullptr ? *report : unused;
  const auto rejected = [&](Rejection why) {
    out.rejection = why;
    return std::nullopt;
  };
  PlaceLandmarks place{landmarks_around(map, candidate, options.neighbours, options.max_landmarks), {}};
  const std::vector<KeypointMatch> matches = match_descriptors(map, frame, place.landmarks, options);
  out.matches = static_cast<int>(matches.size());
  if (out.matches < options.consensus.min_inliers) return rejected(Rejection::kFewMatches);

  solver::PoseSolution solution = estimators::absolute_pose(rig, observations_of(map, frame, matches, features),
                                                            options.pose, options.consensus, random);
  out.inliers = solution.num_inliers;
  if (!solution.ok) return rejected(Rejection::kNoConsensus);

  place.points = map::search_points(map, place.landmarks);
  // Two searches: the consensus pose is accurate to a few pixels, the pose after a guided search to less than one
  // pixel.
  std::vector<KeypointMatch> guided;
  for (const double radius : {options.radius, 0.5 * options.radius}) {
    guided = search_at(rig, frame, place, solution.T_rig_world, radius, options, features);
    solution =
        solver::solve_pose(rig, observations_of(map, frame, guided, features), solution.T_rig_world, options.pose);
    if (!solution.ok) return rejected(Rejection::kNoConsensus);
  }
  out.inliers = solution.num_inliers;
  if (solution.num_inliers < options.min_inliers) return rejected(Rejection::kFewInliers);
  PlaceMatch place_match{candidate, solution.T_rig_world, by_feature(frame, guided, solution.inlier),
                         solution.num_inliers};
  for (const double max_angle : {options.max_viewing_angle, matching::ProjectionSearchOptions{}.max_view_angle}) {
    const std::vector<LandmarkId> expected = expected_landmarks(rig, frame, place, solution.T_rig_world, max_angle);
    const auto is_expected = [&](const auto& match) { return std::ranges::binary_search(expected, match.second); };
    out.expected = static_cast<int>(expected.size());
    out.found = static_cast<int>(std::ranges::count_if(place_match.matches, is_expected));
    // With fewer, the viewing directions are mostly new, and all landmarks predicted visible are compared.
    if (out.expected >= options.min_inliers) break;
  }
  const int most = std::min(out.expected, static_cast<int>(frame.bundled.size()));  // that can be found
  if (out.found < options.min_found_ratio * most) return rejected(Rejection::kFewFound);
  if (most > 0) place_match.found_ratio = static_cast<double>(out.found) / most;
  return place_match;
}

bool contradicts(const map::BundledMap& map, const PlaceMatch& best, const PlaceMatch& other) {
  constexpr double kMinInlierRatio = 0.6;      // inliers relative to the best match
  constexpr double kMaxCentreDistance = 0.05;  // relative to the mean distance to the matched landmarks
  constexpr double kMaxRotation = 0.05;        // rad
  if (other.inliers <= kMinInlierRatio * best.inliers ||
      map.root_of(best.matched_keyframe) != map.root_of(other.matched_keyframe))
    return false;
  const Eigen::Vector3d centre = best.T_rig_world.inverse().translation(),
                        other_centre = other.T_rig_world.inverse().translation();
  double distance = 0;
  for (const auto& [feature, l] : best.matches) distance += (map.landmark(l).position - centre).norm();
  distance /= static_cast<double>(best.matches.size());
  const double rotation = best.T_rig_world.rotation().angularDistance(other.T_rig_world.rotation());
  return (centre - other_centre).norm() > kMaxCentreDistance * distance || rotation > kMaxRotation;
}

}  // namespace bslam::looping
