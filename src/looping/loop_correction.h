// Correction of the map after a loop closure.
#pragma once

#include <optional>

#include "looping/loop_closer.h"
#include "looping/verify_place.h"

namespace bslam::looping {

// Measures the pose error of the map at `keyframe`, assuming that the verified pose is correct.
LoopClosure measure(const map::BundledMap& map, KeyframeId keyframe, const PlaceMatch& place_match);

// Returns true if the keyframe returned to the place and drift on the path between them can explain the error. False
// matches of look-alike places require corrections far beyond drift. Between submaps any correction is plausible.
bool plausible(const map::BundledMap& map, const LoopClosure& closure, const LoopOptions& options);

// Moves the younger submap to the pose given by the verification, merges it into the older one, and fuses duplicate
// landmarks. If the scale is not metric, each submap has its own: the younger one then gets that of the older one.
void merge_submaps(const LoopClosure& closure, const PlaceMatch& place_match, const LoopOptions& options,
                   const feature::FeatureModel& features, map::MapDraft& draft);

// Fuses the landmarks at both ends of the loop and, if the error exceeds what bundle adjustment can remove, distributes
// it over the loop by pose-graph optimisation. Returns false if the optimisation fails; the draft must not be committed
// then.
bool close_loop(const LoopClosure& closure, const PlaceMatch& place_match, const LoopOptions& options,
                const feature::FeatureModel& features, map::MapDraft& draft);

}  // namespace bslam::looping
