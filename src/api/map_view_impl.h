// What a public MapView hides.
#pragma once

#include <bslam/map_view.h>

#include "map/bundled_map.h"

namespace bslam {

struct MapView::Impl {
  map::MapSnapshot map;
};

namespace api {

MapView make_map_view(map::MapSnapshot map);
MapView empty_map_view();  // of a rig of one camera that stands for none

}  // namespace api
}  // namespace bslam
