// Matches between keypoints of a frame and landmarks.
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

// A keypoint matched to a landmark.
struct Match {
  KeypointIndex keypoint;
  LandmarkId landmark;
  bool aligned = false;  // aligned to the landmark's reference patch
};

// Per camera, in order of keypoint. A keypoint has at most one match, a landmark at most one per camera.
using FrameMatches = std::vector<std::vector<Match>>;

std::size_t count(const FrameMatches& matches);

struct MatchSearch {
  FrameMatches found;
  std::vector<LandmarkId> visible;  // predicted in some camera, each once, in order of the input
  std::vector<int> visible_by_camera;
};

// Searches for `landmarks` in every camera at `T_rig_world`. Skips the keypoints and, per camera, the landmarks of the
// matches in `known`.
MatchSearch find_landmarks(const map::BundledMap& map, const frame::BundledFrame& frame,
                           const geometry::SE3& T_rig_world, std::span<const LandmarkId> landmarks,
                           const FrameMatches& known, const matching::ProjectionSearchOptions& options,
                           ThreadPool& pool);

// Union of `a` and `b`, which must have no keypoint in common.
FrameMatches merge(const FrameMatches& a, const FrameMatches& b);

// Aligned position of a matched keypoint.
struct AlignedMatch {
  Eigen::Vector2f pixel;
  Eigen::Vector3d bearing;
  float sigma = 0;
};

// Per camera, in the order of the matches.
using AlignedMatches = std::vector<std::vector<AlignedMatch>>;

// Aligns the image of a landmark to its reference patch, starting at `initial`, a pixel of the image of camera c, with
// the camera poses of `rig` at T_rig_world. Returns nullopt if it cannot be aligned; see matching::align_patch.
std::optional<matching::AlignedKeypoint> align_landmark(const map::BundledMap& map, const camera::Rig& rig,
                                                        std::size_t c, const geometry::SE3& T_rig_world,
                                                        const image::Pyramid& pyramid, LandmarkId landmark,
                                                        const Eigen::Vector2d& initial,
                                                        const matching::AlignmentOptions& options);

// Aligns each matched keypoint of `frame` to the reference patch of its landmark as seen from `T_rig_world`, and sets
// Match::aligned. A keypoint whose patch cannot be aligned keeps its position, with the detector's standard deviation.
// `pyramids` and `alignment`: one per camera.
AlignedMatches align_matches(const map::BundledMap& map, const frame::BundledFrame& frame,
                             const geometry::SE3& T_rig_world, FrameMatches& matches,
                             std::span<const image::Pyramid> pyramids,
                             std::span<const matching::AlignmentOptions> alignment,
                             const feature::FeatureModel& features, ThreadPool& pool);

// `frame` with the matched keypoints for which inlier[i] != 0 at their aligned positions; i counts the matches of all
// cameras.
frame::BundledFrame refined(const frame::BundledFrame& frame, const FrameMatches& matches,
                            const AlignedMatches& aligned, std::span<const std::uint8_t> inlier,
                            const camera::Rig& rig);

// Observations for the pose solver, camera by camera in the order of `matches`, at the aligned positions.
std::vector<solver::PoseObservation> pose_observations(const map::BundledMap& map, const FrameMatches& matches,
                                                       const AlignedMatches& aligned);
// Observations at the positions in the frame, with the standard deviations of its keypoints: those of a frame that was
// refined.
std::vector<solver::PoseObservation> pose_observations(const map::BundledMap& map, const frame::BundledFrame& frame,
                                                       const FrameMatches& matches);
// Observations before alignment, with the detector's standard deviation. (The standard deviation stored with a keypoint
// applies between the cameras of its frame, not to the map.)
std::vector<solver::PoseObservation> pose_observations(const map::BundledMap& map, const frame::BundledFrame& frame,
                                                       const FrameMatches& matches,
                                                       const feature::FeatureModel& features);

// The squared reprojection errors of the matches in the frame's images, px^2; per camera, in the order of the matches.
// nullopt: the landmark is behind the camera.
std::vector<std::vector<std::optional<double>>> squared_errors(const map::BundledMap& map,
                                                               const frame::BundledFrame& frame,
                                                               const geometry::SE3& T_rig_world,
                                                               const FrameMatches& matches);

// The matches whose observation is an inlier.
FrameMatches keep_inliers(const FrameMatches& matches, std::span<const std::uint8_t> inlier);

// The landmarks in `matches`, each once, in order of id.
std::vector<LandmarkId> landmarks_of(const FrameMatches& matches);

}  // namespace bslam::tracking
