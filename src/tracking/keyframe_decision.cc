#include "tracking/keyframe_decision.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>

#include "base/median.h"
#include "frame/rig_at.h"
#include "geometry/triangulation.h"
#include "map/keyframe_landmarks.h"
#include "map/local_view.h"
#include "tracking/make_keyframe.h"

namespace bslam::tracking {
namespace {

constexpr double kRestMaxParallax = 0.01;  // rad; a rig at rest has a smaller parallax
constexpr double kRestMinOverlap = 0.95;
// Minimum number of tracked landmarks; with fewer, the scene may have changed.
constexpr std::size_t kMinLandmarks = 100;
constexpr double kMinShared = 0.6;        // minimum fraction of the inliers that a similar keyframe observes
constexpr std::size_t kNewest = 5;        // number of newest keyframes that do not count as a return
constexpr double kSimilarParallax = 0.5;  // maximum parallax to it, relative to that of a new keyframe

// Close-point rule of ORB-SLAM2 (Mur-Artal & Tardos, T-RO 2017).
bool untracked_depth(const frame::BundledFrame& frame, const FrameMatches& inliers, const TrackingOptions& options) {
  std::vector<std::uint8_t> tracked(frame.bundled.size(), 0);
  for (std::size_t c = 0; c < inliers.size(); ++c) {
    for (const Match& m : inliers[c]) tracked[frame.bundled.feature(CameraIndex(c), m.keypoint).index()] = 1;
  }
  int num_tracked = 0, num_untracked = 0;
  for (std::size_t f = 0; f < frame.bundled.num_matched(); ++f) {
    if (!has_accurate_depth(frame.bundled.point(FeatureId(f)), options.initialisation)) continue;
    ++(tracked[f] ? num_tracked : num_untracked);
  }
  return num_tracked < options.keyframe.min_tracked_close && num_untracked > options.keyframe.max_untracked_close;
}

FrameMatches only(const FrameMatches& matches, std::span<const std::uint8_t> cameras) {
  FrameMatches out(matches.size());
  for (std::size_t c = 0; c < matches.size(); ++c) {
    if (cameras[c]) out[c] = matches[c];
  }
  return out;
}

bool present(const frame::BundledFrame& frame, std::size_t camera) {
  return frame.cameras[camera].state == image::ImageState::kPresent;
}

bool observes(const map::BundledMap& map, KeyframeId k, LandmarkId l) {
  return std::ranges::any_of(map.observations(l), [&](const map::Observation& o) { return o.keyframe == k; });
}

// Angles at the landmarks that the keyframe `then` observes, between the rays to it and to the rig now; in radians.
std::vector<double> parallaxes_to(const map::BundledMap& map, const std::vector<LandmarkId>& landmarks, KeyframeId then,
                                  const geometry::SE3& T_world_now, const geometry::SE3& T_world_then) {
  std::vector<double> out;
  for (const LandmarkId l : landmarks) {
    if (!observes(map, then, l)) continue;
    const Eigen::Vector3d& p = map.landmark(l).position;
    out.push_back(geometry::angle_between(p - T_world_now.translation(), p - T_world_then.translation()));
  }
  return out;
}

// The keyframes that observe most of the landmarks, without the reference and the newest keyframes: a rig that is still
// near them has not returned.
std::vector<KeyframeId> keyframes_that_share(const map::BundledMap& map, const std::vector<LandmarkId>& landmarks,
                                             KeyframeId reference) {
  std::vector<KeyframeId> out;
  for (const auto& [keyframe, shared] : map::observers(map, landmarks)) {
    if (shared < kMinShared * static_cast<double>(landmarks.size())) break;
    if (keyframe != reference && keyframe.index() + kNewest <= map.newest_keyframe().index()) out.push_back(keyframe);
  }
  return out;
}

// The fraction of the landmarks of a keyframe that are in some image of the frame.
double share_in_view(const map::BundledMap& map, KeyframeId keyframe, const frame::BundledFrame& frame,
                     const geometry::SE3& T_rig_world) {
  const frame::RigAt rig_at(map.rig(), frame);
  const camera::Rig& rig = *rig_at;
  const auto in_view = [&](const Eigen::Vector3d& p_rig) {
    for (std::size_t c = 0; c < rig.size(); ++c) {
      if (!present(frame, c)) continue;
      const auto pixel = rig.camera(c).project(rig.cam_from_rig(c) * p_rig);
      if (pixel && rig.camera(c).contains(*pixel)) return true;
    }
    return false;
  };
  int landmarks = 0, seen = 0;
  for (const LandmarkId l : map::landmarks_of(map, keyframe)) {
    ++landmarks;
    seen += in_view(T_rig_world * map.landmark(l).position);
  }
  return landmarks > 0 ? static_cast<double>(seen) / landmarks : 0.0;
}

KeyframeId newest_reference(std::span<const CameraReference> references) {
  return std::ranges::max(references, {}, &CameraReference::keyframe).keyframe;
}

// The cameras that have an image, by the keyframe that they are compared with, the newest one first. It is the newest
// of all also for a camera that is not in it but mostly finds its landmarks: others share its view. Some keyframe must
// have an image of the camera nevertheless, for the depth that it measures together with them.
std::map<KeyframeId, std::vector<std::uint8_t>, std::greater<>> cameras_by_reference(
    const map::BundledMap& map, const frame::BundledFrame& frame, const FrameMatches& inliers,
    std::span<const CameraReference> references) {
  constexpr double kCovered = 0.5;        // fraction of the inliers
  constexpr std::size_t kMaxWithout = 8;  // number of keyframes without an image of a camera whose view others share
  const KeyframeId newest = newest_reference(references);
  std::vector<int> shared;
  std::map<KeyframeId, std::vector<std::uint8_t>, std::greater<>> out;
  for (std::size_t c = 0; c < inliers.size(); ++c) {
    if (!present(frame, c)) continue;
    KeyframeId reference = references[c].keyframe;
    if (reference != newest && newest.index() - reference.index() < kMaxWithout) {
      if (shared.empty()) shared = overlap_by_camera(map, inliers, newest);
      if (shared[c] >= kCovered * static_cast<double>(inliers[c].size())) reference = newest;
    }
    auto& cameras = out[map.nearest_alive_ancestor(reference)];
    cameras.resize(inliers.size());
    cameras[c] = 1;
  }
  return out;
}

// The fraction of the landmarks that a camera observes in a keyframe and that are in its image at the pose; 1 without
// any.
double share_in_image(const map::BundledMap& map, KeyframeId keyframe, std::size_t camera,
                      const geometry::SE3& T_rig_world) {
  const map::BundledKeyframe& then = map.keyframe(keyframe);
  constexpr TimeNs kNow = std::numeric_limits<TimeNs>::max();  // after all moves of cameras so far
  const geometry::SE3 T_cam_world = map.rig().cam_from_rig_at(camera, kNow) * T_rig_world;
  int landmarks = 0, seen = 0;
  for (std::size_t f = 0; f < then.landmarks.size(); ++f) {
    const auto keypoints = then.frame->bundled.keypoints(FeatureId(f));
    const bool by_camera = std::ranges::any_of(keypoints, [&](const auto& k) { return k.camera.index() == camera; });
    if (!by_camera || !then.landmarks[f].valid()) continue;
    const auto pixel = map.rig().camera(camera).project(T_cam_world * map.landmark(then.landmarks[f]).position);
    ++landmarks;
    seen += pixel && map.rig().camera(camera).contains(*pixel);
  }
  return landmarks > 0 ? static_cast<double>(seen) / landmarks : 1.0;
}

// The maximum overlap of cameras with their reference, which was `best` before. If their first images since the
// keyframe are late, a part of its landmarks has left them, and the maximum is what it would have been.
int best_overlap(const map::BundledMap& map, KeyframeId reference, std::span<const std::size_t> late, int overlap,
                 int best, const geometry::SE3& T_rig_world) {
  if (best > 0 || late.empty()) return std::max(best, overlap);
  double share = 1;
  for (const std::size_t c : late) share = std::min(share, share_in_image(map, reference, c, T_rig_world));
  return static_cast<int>(std::lround(overlap / std::max(share, 0.1)));
}

// The overlap of the cameras with their common reference in a frame with features.
void compare_together(const map::BundledMap& map, KeyframeId reference, std::span<const std::uint8_t> cameras,
                      const geometry::SE3& T_rig_world, std::vector<CameraReference>& references,
                      KeyframeEvidence& evidence) {
  std::vector<std::size_t> late;
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    if (!cameras[c]) continue;
    evidence.best_overlap = std::max(evidence.best_overlap, references[c].best_overlap);
    if (references[c].late) late.push_back(c);
  }
  evidence.best_overlap = best_overlap(map, reference, late, evidence.overlap, evidence.best_overlap, T_rig_world);
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    if (cameras[c]) references[c].best_overlap = evidence.best_overlap;
  }
}

// The sum over the overlaps of the single cameras, in a frame that was tracked directly, or in which some of the
// cameras with this reference have no image. `best_of_camera`: the maximum that they are compared with.
void compare_each(const map::BundledMap& map, KeyframeId reference, std::span<const std::uint8_t> cameras,
                  const FrameMatches& inliers, const geometry::SE3& T_rig_world, int CameraReference::*best_of_camera,
                  std::vector<CameraReference>& references, KeyframeEvidence& evidence) {
  const std::vector<int> overlap = overlap_by_camera(map, inliers, reference);
  evidence.overlap = evidence.best_overlap = 0;
  for (std::size_t c = 0; c < overlap.size(); ++c) {
    if (!cameras[c]) continue;
    const std::span late(&c, references[c].late ? 1 : 0);
    int& best = references[c].*best_of_camera;
    best = best_overlap(map, reference, late, overlap[c], best, T_rig_world);
    evidence.overlap += overlap[c];
    evidence.best_overlap += best;
  }
}

// Returns true if every camera with this reference is one of `cameras`, which have an image. Cameras that have never
// found landmarks of it do not count.
bool all_present(const map::BundledMap& map, KeyframeId reference, std::span<const std::uint8_t> cameras,
                 std::span<const CameraReference> references) {
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    if (!cameras[c] && references[c].best_own_overlap > 0 &&
        map.nearest_alive_ancestor(references[c].keyframe) == reference)
      return false;
  }
  return true;
}

// The overlap in a frame with features. Without the images of some cameras it is that of the others one by one, since
// the maximum of all together cannot be reached.
void compare_features(const map::BundledMap& map, KeyframeId reference, std::span<const std::uint8_t> cameras,
                      const FrameMatches& inliers, const geometry::SE3& T_rig_world,
                      std::vector<CameraReference>& references, KeyframeEvidence& evidence) {
  KeyframeEvidence each = evidence;
  compare_each(map, reference, cameras, inliers, T_rig_world, &CameraReference::best_own_overlap, references, each);
  if (all_present(map, reference, cameras, references)) {
    compare_together(map, reference, cameras, T_rig_world, references, evidence);
  } else {
    evidence = each;
  }
}

}  // namespace

std::vector<int> overlap_by_camera(const map::BundledMap& map, const FrameMatches& inliers, KeyframeId reference) {
  std::vector<int> out;
  for (const std::vector<Match>& camera : inliers) {
    const auto shared =
        std::ranges::count_if(camera, [&](const Match& m) { return observes(map, reference, m.landmark); });
    out.push_back(static_cast<int>(shared));
  }
  return out;
}

KeyframeEvidence keyframe_evidence(const map::BundledMap& map, const frame::BundledFrame& frame,
                                   const FrameMatches& inliers, KeyframeId reference, const geometry::SE3& T_rig_world,
                                   const TrackingOptions& options, std::span<const std::uint8_t> cameras) {
  KeyframeEvidence evidence;
  const std::vector<LandmarkId> landmarks = landmarks_of(cameras.empty() ? inliers : only(inliers, cameras));
  std::vector<double> parallaxes =
      parallaxes_to(map, landmarks, reference, T_rig_world.inverse(), map.resolved_pose(reference).inverse());
  evidence.overlap = static_cast<int>(parallaxes.size());
  if (!parallaxes.empty()) {
    const auto near = parallaxes.begin() + static_cast<std::ptrdiff_t>(9 * parallaxes.size() / 10);
    std::nth_element(parallaxes.begin(), near, parallaxes.end());
    evidence.near_parallax = *near;
    evidence.parallax = median(std::move(parallaxes));
  }
  for (std::size_t c = 0; c < inliers.size(); ++c) {
    if (!cameras.empty() && cameras[c] == 0) continue;
    const auto keypoints = static_cast<double>(frame.cameras[c].keypoints.size());
    const auto found = static_cast<double>(inliers[c].size());
    evidence.camera_with_few_inliers |=
        found < options.keyframe.min_camera_inliers && found < options.keyframe.min_camera_inlier_ratio * keypoints;
  }
  evidence.untracked_depth = untracked_depth(frame, inliers, options);
  return evidence;
}

std::vector<KeyframeEvidence> evidence_by_reference(const map::BundledMap& map, const frame::BundledFrame& frame,
                                                    const FrameMatches& inliers, const geometry::SE3& T_rig_world,
                                                    const TrackingOptions& options, bool direct,
                                                    std::vector<CameraReference>& references) {
  std::vector<KeyframeEvidence> out;
  const auto groups = cameras_by_reference(map, frame, inliers, references);
  for (const auto& [reference, compared] : groups) {
    const std::span<const std::uint8_t> some = groups.size() > 1 ? compared : std::span<const std::uint8_t>();
    KeyframeEvidence e = keyframe_evidence(map, frame, inliers, reference, T_rig_world, options, some);
    e.frames_since_keyframe = std::numeric_limits<int>::max();
    for (std::size_t c = 0; c < compared.size(); ++c) {
      if (compared[c]) e.frames_since_keyframe = std::min(e.frames_since_keyframe, references[c].frames);
    }
    if (direct) {
      compare_each(map, reference, compared, inliers, T_rig_world, &CameraReference::best_direct_overlap, references,
                   e);
    } else {
      compare_features(map, reference, compared, inliers, T_rig_world, references, e);
    }
    e.without_newest = reference != map.nearest_alive_ancestor(newest_reference(references));
    // Cameras that hardly see anything, such as dark ones, would ask for a keyframe in each of their images.
    const bool counts = e.best_overlap >= options.consensus.min_expected;
    if (out.empty() || counts || (e.without_newest && e.camera_with_few_inliers)) out.push_back(e);
  }
  return out;
}

void refer_to(KeyframeId keyframe, const frame::BundledFrame& frame, std::vector<CameraReference>& references) {
  references.resize(frame.cameras.size());
  for (std::size_t c = 0; c < references.size(); ++c) {
    if (present(frame, c) || !references[c].keyframe.valid()) references[c] = {keyframe};
  }
}

bool keyframe_due(const KeyframeEvidence& e, const KeyframeOptions& options) {
  if (e.frames_since_keyframe < options.min_interval) return false;
  const double overlap = static_cast<double>(e.overlap) / std::max(1, e.best_overlap);
  if (overlap < options.min_overlap || e.parallax > options.max_parallax) return true;
  const bool at_rest = e.parallax < kRestMaxParallax && overlap > kRestMinOverlap;
  // What a rig at rest has not tracked, such as leaves in the wind, it will not track from another keyframe either. On
  // a drive most landmarks may be too far away to show the motion.
  if (e.untracked_depth && (!at_rest || e.near_parallax >= kRestMaxParallax)) return true;
  const int few_inliers_interval = e.without_newest ? kFewInliersInterval / 2 : kFewInliersInterval;
  if (e.camera_with_few_inliers && e.frames_since_keyframe >= few_inliers_interval && !at_rest) return true;
  return e.frames_since_keyframe >= options.max_interval && !at_rest;
}

std::optional<KeyframeId> similar_keyframe(const map::BundledMap& map, const frame::BundledFrame& frame,
                                           const FrameMatches& inliers, KeyframeId reference,
                                           const geometry::SE3& T_rig_world, const KeyframeOptions& options) {
  const std::vector<LandmarkId> landmarks = landmarks_of(inliers);
  if (landmarks.size() < kMinLandmarks) return std::nullopt;
  const geometry::SE3 T_world_rig = T_rig_world.inverse();
  std::optional<KeyframeId> similar;
  double smallest = kSimilarParallax * options.max_parallax;
  for (const KeyframeId k : keyframes_that_share(map, landmarks, reference)) {
    const double parallax =
        median(parallaxes_to(map, landmarks, k, T_world_rig, map.keyframe(k).T_rig_world.inverse()));
    if (parallax >= smallest || share_in_view(map, k, frame, T_rig_world) < options.min_overlap) continue;
    similar = k;
    smallest = parallax;
  }
  return similar;
}

}  // namespace bslam::tracking
