// What a recognised place changes in the map.
#pragma once

#include <optional>

#include "looping/locate.h"
#include "looping/loop_closer.h"

namespace bslam::looping {

// By how much the world about `keyframe` is off, if the location is right.
LoopClosure measure(const map::BundledMap& map, KeyframeId keyframe, const Location& location);

// Is it a return to the place, and could the error have grown to that on the way from the place to the keyframe? What
// looks the same but is somewhere else asks for corrections far beyond drift. Parts that are not joined yet can be
// anywhere, but without a metric scale they cannot be joined.
bool plausible(const map::BundledMap& map, const LoopClosure& closure, const LoopOptions& options);

// Moves the part of one to where the other's says it is, and hangs it below. False, with nothing changed, where scales
// are not metric: parts then have units of their own.
bool join_parts(const LoopClosure& closure, const Location& location, const LoopOptions& options,
                const feature::FeatureModel& features, map::MapDraft& draft);

// Fuses what is seen on both ends of the loop and, where the map is off by more than bundle adjustment mends by itself,
// spreads the error over the loop by pose-graph optimisation. False, with the draft in no state to be committed, where
// that fails.
bool close_loop(const LoopClosure& closure, const Location& location, const LoopOptions& options,
                const feature::FeatureModel& features, map::MapDraft& draft);

}  // namespace bslam::looping
