// Implementation of the public class MapView.
#pragma once

#include <bslam/map_view.h>

#include "map/bundled_map.h"

namespace bslam {

struct MapView::Impl {
  map::MapSnapshot map;
};

namespace api {

MapView make_map_view(map::MapSnapshot map);
MapView empty_map_view();  // has a rig with one placeholder camera, since a rig cannot be empty

}  // namespace api
}  // namespace bslam
