// A simulated map that was adjusted as a whole with constant calibration.
#pragma once

#include <gtest/gtest.h>

#include "adjustment/map_adjustment.h"
#include "mapping/simulated_map.h"

namespace bslam::map {

inline BundledMap adjusted(SimulatedMap& world, const feature::FeatureModel& features) {
  adjustment::Selection all;
  for (const KeyframeId k : world.map.keyframe_ids())
    (k.value() == 0 ? all.fixed_keyframes : all.free_keyframes).push_back(k);
  all.landmarks = world.map.landmark_ids();
  MapDraft draft = world.draft();
  EXPECT_TRUE(adjustment::adjust_map(all, {}, features, draft));
  return draft.map();
}

}  // namespace bslam::map
