// A small map, and what its exports need, for the tests of this folder.
#pragma once

#include <vector>

#include "map_export/image_table.h"
#include "map_export/landmark_colours.h"
#include "map_export/output_cameras.h"
#include "storage/small_map.h"
#include "synthetic/rigs.h"

namespace bslam::map_export {

struct ExportedMap {
  explicit ExportedMap(camera::Rig rig, bool undistort = false)
      : map(storage::small_map(std::move(rig))),
        selection(select_submap(map, 0).value()),
        images(selection, nullptr, {}),
        cameras(map.rig(), undistort),
        colours(landmark_colours(selection, images)) {}

  map::BundledMap map;
  Selection selection;
  ImageTable images;
  OutputCameras cameras;
  LandmarkColours colours;
};

// The cameras of a rig with another model each.
inline camera::Rig with_models(const camera::Rig& rig, const std::vector<camera::CameraModel>& models) {
  std::vector<camera::RigCamera> cameras;
  for (std::size_t c = 0; c < rig.size(); ++c) {
    cameras.push_back({rig.camera(c), rig.body_from_cam(c)});
    cameras.back().camera.model = models[c % models.size()];
  }
  return camera::Rig(std::move(cameras));
}

}  // namespace bslam::map_export
