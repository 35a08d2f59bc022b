// Landmarks that only one keyframe observes, with several cameras.
#pragma once

#include "map/map_edit.h"

namespace bslam::calibration {

// Triangulates these landmarks again with the calibration of the draft's map. Bundle adjustment, in which they have no
// part, keeps their positions relative to their keyframe, which are those of the calibration they were created with.
// Landmarks whose rays do not intersect in front of the cameras keep their position.
void triangulate_single_views(map::MapDraft& draft);

}  // namespace bslam::calibration
