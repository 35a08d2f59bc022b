// Landmarks that only one keyframe observes, with several cameras.
#pragma once

#include "map/map_edit.h"

namespace bslam::calibration {

// Triangulates these landmarks again with the calibration of the draft's map. Bundle adjustment does not include them.
// Until then they keep the position relative to their keyframe that follows from the calibration with which they were
// created. Landmarks whose rays do not intersect in front of the cameras keep their position.
void triangulate_single_views(map::MapDraft& draft);

}  // namespace bslam::calibration
