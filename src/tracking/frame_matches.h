// Which keypoints of a frame show which landmarks.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "base/thread_pool.h"
#include "frame/bundled_frame.h"
#include "map/bundled_map.h"
#include "matching/bundling.h"
#include "matching/patch_alignment.h"
#include "matching/projection_search.h"
#include "solver/pose_solver.h"
#include "tracking/options.h"

namespace bslam::tracking {

// One keypoint that shows a landmark.
struct Match {
  KeypointIndex keypoint;
  LandmarkId landmark;
  bool aligned = false;  // to the landmark's reference patch
};

// Per camera, in order of keypoint; a keypoint at most once, a landmark at most once per camera.
using FrameMatches = std::vector<std::vector<Match>>;

std::size_t count(const FrameMatches& matches);

struct MatchSearch {
  FrameMatches found;
  std::vector<LandmarkId> visible;  // expected in some camera, each once, in order of the input
  std::vector<int> visible_by_camera;
};

// Looks for `landmarks` in every camera at `T_rig_world`, leaving out the keypoints and, per camera, the landmarks that
// are in `known` already.
MatchSearch find_landmarks(const map::BundledMap& map, const frame::BundledFrame& frame,
                           const geometry::SE3& T_rig_world, std::span<const LandmarkId> landmarks,
                           const FrameMatches& known, const matching::ProjectionSearchOptions& options,
                           ThreadPool& pool);

// `a` and `b` together; they share no keypoint.
FrameMatches merge(const FrameMatches& a, const FrameMatches& b);

// Aligned position of a matched keypoint.
struct AlignedMatch {
  Eigen::Vector2f pixel;
  Eigen::Vector3d bearing;
  float sigma = 0;
};

// Per camera, in the order of the matches.
using AlignedMatches = std::vector<std::vector<AlignedMatch>>;

// Aligns each matched keypoint of `frame` to the reference patch of its landmark as seen from `T_rig_world`. A keypoint
// whose patch does not align keeps its position, with the detector's standard deviation. `matches` are told which did
// align. `pyramids` and `alignment`: one per camera.
AlignedMatches align_matches(const map::BundledMap& map, const frame::BundledFrame& frame,
                             const geometry::SE3& T_rig_world, FrameMatches& matches,
                             std::span<const image::Pyramid> pyramids,
                             std::span<const matching::AlignmentOptions> alignment,
                             const matching::DetectionNoise& noise, ThreadPool& pool);

// `frame` with the matched keypoints at their aligned positions where inlier[i] != 0, counted over all cameras.
frame::BundledFrame refined(const frame::BundledFrame& frame, const FrameMatches& matches,
                            const AlignedMatches& aligned, std::span<const std::uint8_t> inlier,
                            const camera::Rig& rig);

// Observations for the pose solver, camera by camera in the order of `matches`: as aligned to the landmarks.
std::vector<solver::PoseObservation> pose_observations(const map::BundledMap& map, const FrameMatches& matches,
                                                       const AlignedMatches& aligned);
// Before alignment: a keypoint's own standard deviation holds between the cameras of its frame, against the map that of
// the detector does.
std::vector<solver::PoseObservation> pose_observations(const map::BundledMap& map, const frame::BundledFrame& frame,
                                                       const FrameMatches& matches,
                                                       const matching::DetectionNoise& noise);

// The matches whose observation is an inlier.
FrameMatches keep_inliers(const FrameMatches& matches, std::span<const std::uint8_t> inlier);

// The landmarks in `matches`, each once, in order of id.
std::vector<LandmarkId> landmarks_of(const FrameMatches& matches);

}  // namespace bslam::tracking
