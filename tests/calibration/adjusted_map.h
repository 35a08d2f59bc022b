// Simulated maps that were adjusted as a whole with constant calibration.
#pragma once

#include <gtest/gtest.h>

#include "adjustment/map_adjustment.h"
#include "mapping/simulated_map.h"

namespace bslam::map {

// A rig on an orbit of a minute.
inline synthetic::FeatureSimulator orbit_simulator(const camera::Rig& rig, const feature::FeatureModel& features) {
  synthetic::FeatureSimulatorOptions options;
  options.landmarks = 2500;
  options.max_keypoints = 250;
  options.sigma_px = features.sigma_px;
  return {rig, synthetic::make_orbit({.duration_s = 60}), options};
}

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
