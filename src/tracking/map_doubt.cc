#include "tracking/map_doubt.h"

#include <algorithm>
#include <cmath>

#include "map/keyframe_landmarks.h"

namespace bslam::tracking {
namespace {

// Maximum number of keyframes of a map without metric scale that is discarded if tracking is lost, and of a map that is
// discarded if the cameras that determine its scale contradict it, or its poses are undecided.
constexpr std::size_t kMaxFailedMap = 4, kMaxContradictedMap = 8;
// Maximum age of such a map, in seconds. A rig that hardly moves adds few keyframes, but a map that has agreed with the
// images for longer is right.
constexpr double kMaxFailedAge_s = 3.0;
// After this number of such maps the contradicting cameras are assumed to be wrong instead, and undecided poses to be
// right.
constexpr int kMaxContradictions = 3;

// Returns true if the frame is lost although it has features: the map may be wrong.
bool disowns_map(const TrackResult& result) {
  return result.reason == LostReason::kFewMatches || result.reason == LostReason::kFewInliers ||
         result.reason == LostReason::kUnstablePose;
}

bool overlaps_any(const camera::Rig& rig, std::size_t camera) {
  for (std::size_t other = 0; other < rig.size(); ++other) {
    if (rig.share_view(camera, other)) return true;
  }
  return false;
}

}  // namespace

bool contradicts_pose(const CameraCounts& camera) {
  constexpr int kMinMatches = 30;
  constexpr double kMinShare = 0.25, kHalf = 0.5, kSigmas = 3;
  const double sigma = std::sqrt(kHalf * (1 - kHalf) * camera.matched);
  const double least = std::max(kMinShare * camera.matched, kHalf * camera.matched - kSigmas * sigma);
  return camera.matched >= kMinMatches && camera.inliers < least;
}

MapDoubt::MapDoubt(const camera::Rig& rig) {
  for (std::size_t c = 0; c < rig.size(); ++c) overlapping_.push_back(overlaps_any(rig, c));
}

bool MapDoubt::update(const FrameRecord& record, const map::BundledMap& seen, bool calibration_compared) {
  const TrackResult& result = record.result;
  const bool undecided = result.contest.undecided && calibration_compared;
  while (!undecided_ns_.empty() && to_seconds(result.time_ns - undecided_ns_.front()) > kContestedWithin_s)
    undecided_ns_.pop_front();
  const bool lost_in_it = disowned(result, seen);
  const bool wrong = !lost_in_it && contradicted(result, seen, undecided);
  contradictions_ += wrong;
  if (lost_in_it || wrong) {
    started_ns_.reset();
    undecided_ns_.clear();
    return true;
  }
  if (result.status != TrackStatus::kTracking) return false;
  if (!started_ns_) {
    started_ns_ = result.time_ns;
    first_keyframe_ = seen.keyframe_slots();
  }
  if (undecided) undecided_ns_.push_back(result.time_ns);
  return false;
}

// Returns true if the map consists of at most this number of keyframes and was initialised recently.
bool MapDoubt::is_new(TimeNs time_ns, const map::BundledMap& seen, std::size_t max_keyframes) const {
  return started_ns_ && to_seconds(time_ns - *started_ns_) <= kMaxFailedAge_s &&
         seen.keyframe_slots() - first_keyframe_ <= max_keyframes;
}

// Returns true if a recent monocular initialisation was wrong: the frames after it are lost, although they have images
// of cameras that observe the map.
bool MapDoubt::disowned(const TrackResult& result, const map::BundledMap& seen) const {
  return seen.scale() != map::Scale::kMetric && disowns_map(result) && is_new(result.time_ns, seen, kMaxFailedMap) &&
         observed_by_cameras_of(result, seen);
}

// Returns true if a camera with an image in this frame observes a considerable part of the landmarks of some keyframe
// of the new map. Without such images a frame is lost in every map.
bool MapDoubt::observed_by_cameras_of(const TrackResult& result, const map::BundledMap& seen) const {
  constexpr int kMinKeypoints = 30, kPart = 4;  // at least a quarter
  for (std::size_t k = first_keyframe_; k < seen.keyframe_slots(); ++k) {
    if (!seen.alive(KeyframeId(k))) continue;
    const std::vector<int> landmarks = map::landmarks_by_camera(seen.keyframe(KeyframeId(k)));
    const int all = std::ranges::max(landmarks);
    for (std::size_t c = 0; c < landmarks.size() && c < result.cameras.size(); ++c) {
      if (kPart * landmarks[c] >= all && all > 0 && result.cameras[c].keypoints >= kMinKeypoints) return true;
    }
  }
  return false;
}

// Returns true if a recent initialisation was wrong, because most of its points were on a moving object: the cameras
// that determine the scale contradict it, or the landmarks support two motions in many frames up to this one. Those of
// a new map may be relative to a moving object.
bool MapDoubt::contradicted(const TrackResult& result, const map::BundledMap& seen, bool undecided) const {
  if (contradictions_ >= kMaxContradictions || !is_new(result.time_ns, seen, kMaxContradictedMap)) return false;
  const bool metric = seen.scale() == map::Scale::kMetric;
  return (metric && scale_contradicted(result)) || (undecided && 1 + undecided_ns_.size() >= kContestedFrames);
}

// Returns true if the cameras that overlap with others contradict the map, and only cameras without overlap agree with
// it. Cameras without overlap are consistent with any scale, so that they must not outvote those that determine it.
bool MapDoubt::scale_contradicted(const TrackResult& result) const {
  if (result.status != TrackStatus::kTracking) return false;
  bool contradicted = false;
  for (std::size_t c = 0; c < result.cameras.size(); ++c) {
    if (!overlapping_[c]) continue;
    if (!result.cameras[c].excluded && result.cameras[c].inliers > 0) return false;
    contradicted |= result.cameras[c].excluded;
  }
  return contradicted;
}

}  // namespace bslam::tracking
