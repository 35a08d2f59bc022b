// The use of an estimated calibration in the map.
#pragma once

#include <stop_token>

#include "calibration/rig_refinement.h"
#include "map/map_edit.h"
#include "system/config.h"

namespace bslam::system {

// Replaces the rig of the draft's map by an estimate and adjusts the map with it. If there are new moves of cameras,
// the landmarks of the keyframes after them are searched for again: those that were found agree with the extrinsics
// before the move, so that an estimate from them is biased. Another one from the result is more accurate. Returns true
// if there are new moves, which the map did not take into account before.
bool use_calibration(const calibration::RigRefinement& refinement, const Config& config, map::MapDraft& draft,
                     const std::stop_token& stop);

}  // namespace bslam::system
