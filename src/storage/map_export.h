// A map in formats of other programs, and in figures.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "base/result.h"
#include "base/timestamp.h"
#include "evaluation/trajectory.h"
#include "map/bundled_map.h"

namespace bslam::storage {

// One part of a map: keyframes that hang together.
struct MapPart {
  KeyframeId root;
  std::vector<KeyframeId> keyframes;                 // in order of time; of equal times in order of id
  std::size_t landmarks = 0;                         // whose reference is one of them
  Eigen::Vector3d extent = Eigen::Vector3d::Zero();  // metres, map: sides of the box around the keyframes' cameras 0
};

// In order of their roots.
std::vector<MapPart> map_parts(const map::BundledMap& map);

// First and last time of the keyframes of a part.
TimeNs first_time(const map::BundledMap& map, const MapPart& part);
TimeNs last_time(const map::BundledMap& map, const MapPart& part);

// T_world_cam0 of the keyframes of a part; of those of one time the first.
evaluation::Trajectory keyframe_trajectory(const map::BundledMap& map, const MapPart& part);

// All landmarks as a binary PLY: x, y, z as doubles and the number of keypoints that observe each.
std::string landmarks_ply(const map::BundledMap& map);

// The text model of COLMAP (cameras.txt, images.txt, points3D.txt): one image for each present camera of each keyframe,
// named CAMERA/STAMP.png with the stamp of the recording in ns, all its keypoints; every landmark a grey point.
// COLMAP's pixels begin at the corner of the image, ours at the centre of the first pixel: 0.5 is added. Error (file
// left empty) where a camera has a model that COLMAP has not.
struct ColmapModel {
  std::string cameras, images, points;
};
Result<ColmapModel> colmap_model(const map::BundledMap& map);

}  // namespace bslam::storage
