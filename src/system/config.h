// Every setting of a run, gathered: one struct per stage, with defaults beside their meaning.
#pragma once

#include "adjustment/rig_refinement.h"
#include "base/options.h"
#include "feature/extractor.h"
#include "frame/bundling.h"
#include "looping/options.h"
#include "mapping/options.h"
#include "system/camera_health.h"
#include "tracking/options.h"

namespace bslam::system {

// When stages run, never what they compute.
enum class Mode {
  kSequential,  // each stage to its commit before the next frame: identical bytes on every run
  kLagged,      // stages in threads of their own, results seen a fixed number of frames later: identical bytes as well
  kParallel,    // stages in threads of their own, newest version wins: for live use
};

struct IoOptions {
  double sync_tolerance = 0.002;  // s: images of different cameras within it make one frame

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("sync_tolerance", self.sync_tolerance, Range{0, 1}, "s", "images of different cameras within it make one frame");
  }
};

struct ExecutionOptions {
  int threads = 0;            // for loops over cameras; 0 = as many as the machine runs at once, at most one per camera
  int pending_keyframes = 3;  // that may wait for a background stage before what feeds it waits
  // Lagged mode: a stage's result is seen that many frames after the one at which it began. Little more than the stage
  // takes, so that nobody waits; kGlobal's is for maps of some hundred keyframes.
  int lag_map = 3, lag_loop = 5, lag_global = 40;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("threads", self.threads, Range{0, 256}, "", "threads for loops over cameras; 0 = what the machine has");
    visitor("pending_keyframes", self.pending_keyframes, Range{1, 1000}, "", "keyframes that may wait for a background stage");
    visitor("lag_map", self.lag_map, Range{1, 10000}, "frames", "lagged mode: from the begin of mapping to its result");
    visitor("lag_loop", self.lag_loop, Range{1, 10000}, "frames", "lagged mode: the same of loop closing");
    visitor("lag_global", self.lag_global, Range{1, 10000}, "frames", "lagged mode: the same of global adjustment");
  }
};

struct Config {
  int seed = 1;
  bool final_adjustment = true;  // global bundle adjustment at the end
  bool localize_only = false;    // poses in a loaded map, which stays as it is
  Mode mode = Mode::kParallel;
  IoOptions io;
  ExecutionOptions execution;
  HealthOptions health;
  feature::FeatureOptions features;
  frame::BundlingOptions bundling;
  tracking::TrackingOptions tracking;
  mapping::MappingOptions mapping;
  looping::LoopingOptions looping;
  adjustment::RigRefinementOptions extrinsics;

  mapping::FeatureModel feature_model() const { return {features.sigma_px, features.scale_factor}; }

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("seed", self.seed, Range{0, 2147483647}, "", "of all randomness");
    visitor("final_adjustment", self.final_adjustment, Range{}, "", "global bundle adjustment at the end");
    visitor("localize_only", self.localize_only, Range{}, "", "poses in a loaded map, which stays as it is");
    visitor("mode", self.mode, Range{}, "", "when stages run");
    visitor.section("io", self.io);
    visitor.section("execution", self.execution);
    visitor.section("health", self.health);
    visitor.section("features", self.features);
    visitor.section("bundling", self.bundling);
    visitor.section("tracking", self.tracking);
    visitor.section("mapping", self.mapping);
    visitor.section("looping", self.looping);
    visitor.section("extrinsics", self.extrinsics);
  }
};

}  // namespace bslam::system

template <>
struct bslam::EnumNames<bslam::system::Mode> {
  static constexpr EnumName<system::Mode> kNames[] = {{system::Mode::kSequential, "sequential"},
                                                      {system::Mode::kLagged, "lagged"},
                                                      {system::Mode::kParallel, "parallel"}};
};
