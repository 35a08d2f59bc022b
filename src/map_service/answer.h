// The answers of the service as JSON. The members are documented in docs/serve.md.
#pragma once

#include <string>
#include <string_view>

#include "camera/rig.h"
#include "map/bundled_map.h"
#include "tracking/frame_record.h"

namespace bslam::map_service {

// The result of a frame. It contains no times, so that it depends on the images only.
std::string localisation_json(const tracking::FrameRecord& record, const camera::Rig& rig);

// Metadata of the map.
struct MapSource {
  std::string name;     // without a folder
  std::string data;     // name of the recording
  std::string made_by;  // version of the program
  std::string id;       // equal if and only if the files are
  std::string warning;  // reason why its poses cannot be relied on; empty: none known
};

// `rig`: the cameras that requests may have.
std::string map_json(const MapSource& source, const map::BundledMap& map, const camera::Rig& rig);

std::string error_json(std::string_view message);

}  // namespace bslam::map_service
