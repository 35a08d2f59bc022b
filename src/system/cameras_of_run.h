// Conversions for a run in a map that also has cameras of other rigs, so that the rig of the run is a part of the rig
// of the map.
#pragma once

#include <vector>

#include "base/result.h"
#include "image/image_bundle.h"
#include "map/bundled_map.h"
#include "system/config.h"
#include "tracking/frame_record.h"
#include "tracking/observed_keypoints.h"

namespace bslam::system {

// Whether the map has, or will have in a run with `rig`, cameras of other rigs or calibrations; the run then keeps its
// calibration as given.
bool shared_with_other_rigs(const map::BundledMap& map, const camera::Rig& rig);
// Checks the settings of a run with `rig` in the loaded map: in a map with other rigs, the calibration cannot be
// refined.
Status check_settings(const Config& config, const map::BundledMap& map, const camera::Rig& rig);
// Adapts the settings to a map with other rigs: the calibration is not estimated.
void note_other_rigs(const map::BundledMap& map, const camera::Rig& rig, Config& config);

// Returns the images for the rig of the map, which has `all` cameras; the other cameras have no images. The pixels are
// borrowed from `images`.
image::ImageBundle widened(const image::ImageBundle& images, CamerasOfRun cameras, std::size_t all);
// One mask per camera of the map's rig; none if there are none.
std::vector<image::Image> widened(std::vector<image::Image> masks, CamerasOfRun cameras, std::size_t all);

// Removes the entries of a record for the cameras of other rigs.
void narrow(tracking::FrameRecord& record, CamerasOfRun cameras);
void narrow(tracking::TrackResult& result, CamerasOfRun cameras);
void narrow(std::vector<tracking::ObservedKeypoints>& keypoints, CamerasOfRun cameras);

}  // namespace bslam::system
