// Search by projection: matches points of known position to the keypoints of a camera. Used by tracking, mapping and
// loop closing.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/id.h"
#include "base/thread_pool.h"
#include "camera/camera.h"
#include "frame/bundled_frame.h"
#include "geometry/se3.h"

namespace bslam::matching {

// A point to search for. Its size is known from the image it was detected in, as the width at the point of a pixel of
// the level there. An image of any angular resolution shows it on the level whose pixels have this width.
struct SearchPoint {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();        // metres, common frame
  Eigen::Vector3d view_direction = Eigen::Vector3d::Zero();  // mean unit vector to it, common frame; zero: unknown
  float min_pixel = 0;  // metres, width of a level-0 pixel at the point if it is on the coarsest level
  float max_pixel = 0;  // metres, the same if it is on level 0; not positive: unknown
  const feature::Descriptor* descriptor = nullptr;
};

// Flags of keypoints and points that are excluded from the search in one camera. Empty: none.
struct SearchExclusions {
  std::vector<std::uint8_t> keypoints;
  std::vector<std::uint8_t> points;
};

struct ProjectionSearchOptions {
  double radius = 0.02;          // rad, search radius at level 0; proportional to the scale of the predicted level
  int max_hamming = 80;          // maximum descriptor distance, of 256 bits
  double ratio = 0.9;            // maximum ratio of best to second best descriptor distance on the same level
  int level_slack = 1;           // maximum difference to the predicted level
  double max_view_angle = 1.05;  // rad, maximum angle between the current and the mean viewing direction
  double scale_factor = 1.2;     // scale factor of the pyramid
};

struct ProjectionMatch {
  std::uint32_t point = 0;
  KeypointIndex keypoint;
  int hamming = 0;
};

struct ProjectionSearchResult {
  std::vector<ProjectionMatch> matches;  // in order of point; each point and each keypoint at most once
  std::vector<std::uint32_t> visible;    // points in the image, within the distance range and view angle
};

// Searches for the points in one camera. `T_cam_common` maps points to the camera frame.
ProjectionSearchResult search_by_projection(const camera::Rig& rig, CameraIndex c, const frame::CameraFrame& frame,
                                            const geometry::SE3& T_cam_common, std::span<const SearchPoint> points,
                                            const SearchExclusions& exclusions, const ProjectionSearchOptions& options);

// Searches for the points in all cameras of a frame; one result per camera, empty if the camera has no keypoints.
// `T_cam_common`: one pose per camera. `exclusions`: one entry per camera, or empty. Cameras are searched in parallel
// if a pool is given.
std::vector<ProjectionSearchResult> search_cameras(const camera::Rig& rig, const frame::BundledFrame& frame,
                                                   std::span<const geometry::SE3> T_cam_common,
                                                   std::span<const SearchPoint> points,
                                                   std::span<const SearchExclusions> exclusions,
                                                   const ProjectionSearchOptions& options, ThreadPool* pool = nullptr);

// Poses of the cameras of a rig at `T_rig_common`.
std::vector<geometry::SE3> camera_poses(const camera::Rig& rig, const geometry::SE3& T_rig_common);

// A point predicted visible in a camera.
struct VisiblePoint {
  std::uint32_t point = 0;
  Eigen::Vector2d pixel;  // level-0 pixels
  double scale = 0;       // size in the image relative to a feature of level 0; 0: unknown
};

// The points predicted visible in a camera, in order; see ProjectionSearchResult::visible. `max_view_angle`: radians.
std::vector<VisiblePoint> visible_points(const camera::Rig& rig, CameraIndex c, const geometry::SE3& T_cam_common,
                                         std::span<const SearchPoint> points, double max_view_angle);

}  // namespace bslam::matching
