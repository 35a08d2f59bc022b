// Search by projection: where in one camera's keypoints are these points of known place? Over plain spans, so that
// tracker, mapper and loop closer share it.
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

// A point to look for.
struct SearchPoint {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  // metres, common frame
  Eigen::Vector3d view_direction =
      Eigen::Vector3d::Zero();  // mean unit vector towards it, common frame; zero = unknown
  float min_distance = 0;       // metres: seen on the coarsest level
  float max_distance = 0;       // metres: seen on level 0
  const feature::Descriptor* descriptor = nullptr;
};

// What is left out of the search in one camera, as flags. Empty: nothing is.
struct SearchExclusions {
  std::vector<std::uint8_t> keypoints;
  std::vector<std::uint8_t> points;
};

struct ProjectionSearchOptions {
  double radius = 0.02;          // radians about the prediction at level 0; grows with the predicted level
  int max_hamming = 80;          // of 256 bits
  double ratio = 0.9;            // best to second best on the same level
  int level_slack = 1;           // levels around the predicted one
  double max_view_angle = 1.05;  // radians between the present and the mean viewing direction
  double scale_factor = 1.2;     // of the pyramid
};

struct ProjectionMatch {
  std::uint32_t point = 0;
  KeypointIndex keypoint;
  int hamming = 0;
};

struct ProjectionSearchResult {
  std::vector<ProjectionMatch> matches;  // in order of point; each point and each keypoint at most once
  std::vector<std::uint32_t> visible;    // points that project into the image within distance and view angle
};

// Looks for the points in one camera. `T_cam_common` maps points to the camera.
ProjectionSearchResult search_by_projection(const camera::Camera& camera, const frame::CameraFrame& frame,
                                            const geometry::SE3& T_cam_common, std::span<const SearchPoint> points,
                                            const SearchExclusions& exclusions, const ProjectionSearchOptions& options);

// Looks for the points in every camera of a frame that has keypoints; one result per camera. `T_cam_common` holds a
// pose per camera, `exclusions` as well or nothing. Cameras are searched in parallel where a pool is given.
std::vector<ProjectionSearchResult> search_cameras(const camera::Rig& rig, const frame::BundledFrame& frame,
                                                   std::span<const geometry::SE3> T_cam_common,
                                                   std::span<const SearchPoint> points,
                                                   std::span<const SearchExclusions> exclusions,
                                                   const ProjectionSearchOptions& options, ThreadPool* pool = nullptr);

// Poses of the cameras of a rig at `T_rig_common`.
std::vector<geometry::SE3> camera_poses(const camera::Rig& rig, const geometry::SE3& T_rig_common);

// Of the points, those a camera should see, by the rules of ProjectionSearchResult::visible. `max_view_angle` in
// radians.
std::vector<std::uint32_t> visible_points(const camera::Camera& camera, const geometry::SE3& T_cam_common,
                                          std::span<const SearchPoint> points, double max_view_angle);

}  // namespace bslam::matching
