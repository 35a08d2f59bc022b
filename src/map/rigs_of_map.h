// A map serves any rig. The cameras of a rig that the map does not have yet are appended to those of the map, so that
// old keyframes keep the cameras and the calibration with which they were recorded, and every image belongs to a camera
// of its own calibration. All rigs of a map share the rig frame, which is the first camera of each as it was given.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "map/bundled_map.h"

namespace bslam::map {

// Returns the index of the map's camera that is camera 0 of `rig`, if the cameras of `rig` are consecutive cameras of
// the map and that one is the first camera of a rig. Cameras are equal if `rig` has their calibration, or that which
// they had before a run refined it, and the name of no other camera of the map. Rigs without moves of cameras come
// first.
std::optional<std::size_t> find_rig(const BundledMap& map, const camera::Rig& rig);

// As find_rig, but appends the cameras if the map does not have them, or if a camera was moved while the map was made:
// then they are appended as they are since its last move. A camera whose name is already used is renamed to
// camN, with its index N in the map.
std::size_t find_or_append_rig(BundledMap& map, const camera::Rig& rig);

// Finds or appends all rigs of `other`, with their calibrations as given and as refined, and returns for each camera of
// `other` that of `map`. The cameras of a keyframe keep their order.
std::vector<CameraIndex> find_or_append_rigs(BundledMap& map, const BundledMap& other);

// For each camera of the map, the camera of `rig` that it is, if there is one. All cameras of its rig in the map, or
// all of `rig` if these are fewer, must have the same calibration, or that which they had before a run refined it, and
// the same arrangement in both; names tell cameras apart that have the same calibration.
std::vector<std::optional<std::size_t>> find_cameras(const BundledMap& map, const camera::Rig& rig);

// For each camera of the map, the first camera of its rig.
std::vector<std::size_t> first_cameras_of_rigs(const BundledMap& map);

// Returns `whole` with cameras `first`, `first` + 1, ... replaced by those of `part`, whose camera 0 takes the place of
// camera `first`. If there are no other cameras, the result is `part`.
camera::Rig with_cameras(const camera::Rig& whole, std::size_t first, const camera::Rig& part);

// The inverse: cameras `first` to `first` + `size` - 1 of `whole`.
camera::Rig cameras_of(const camera::Rig& whole, std::size_t first, std::size_t size);

}  // namespace bslam::map
