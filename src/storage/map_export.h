// Exports maps to formats of other programs, and computes their statistics.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "base/result.h"
#include "base/timestamp.h"
#include "evaluation/trajectory.h"
#include "map/bundled_map.h"

namespace bslam::storage {

// A submap: keyframes that are connected by one spanning tree.
struct Submap {
  KeyframeId root;
  std::vector<KeyframeId> keyframes;                 // ordered by time, then by id
  std::size_t landmarks = 0;                         // number of landmarks whose reference keyframe is in this submap
  Eigen::Vector3d extent = Eigen::Vector3d::Zero();  // metres: sides of the box around camera 0 of all keyframes, along
                                                     // the axes of the world
};

// Returns the submaps in the order of their root keyframes.
std::vector<Submap> submaps_of(const map::BundledMap& map);

// Returns the times of the first and the last keyframe of a submap.
TimeNs first_time(const map::BundledMap& map, const Submap& submap);
TimeNs last_time(const map::BundledMap& map, const Submap& submap);

// Returns T_world_cam0 of the keyframes of a submap. Of keyframes with equal times only the first is included.
evaluation::Trajectory keyframe_trajectory(const map::BundledMap& map, const Submap& submap);

// Returns all landmarks as a binary PLY: x, y, z as doubles, and the number of observing keypoints.
std::string landmarks_ply(const map::BundledMap& map);

// Returns the name of the image of a camera with a given time stamp, relative to the image folder of COLMAP.
using ImageNamer = std::function<std::string(std::size_t camera, TimeNs stamp_ns)>;

// Returns the text model of COLMAP (cameras.txt, images.txt, points3D.txt): one image with all its keypoints for each
// present camera of each keyframe, and a grey point for every landmark. Without `name`, images are called
// CAMERA/STAMP.png with the time stamp in ns. 0.5 is added to pixel coordinates, since the origin is the corner of the
// top-left pixel in COLMAP and its centre in bslam. Error (file left empty) if COLMAP does not support the model of a
// camera.
struct ColmapModel {
  std::string cameras, images, points;
};
Result<ColmapModel> colmap_model(const map::BundledMap& map, const ImageNamer& name = {});

}  // namespace bslam::storage
