// Every setting of a run, gathered: one struct per stage, with defaults beside their meaning.
#pragma once

#include "base/options.h"
#include "feature/extractor.h"
#include "frame/bundling.h"
#include "mapping/options.h"
#include "tracking/options.h"

namespace bslam::system {

// When stages run, never what they compute.
enum class Mode {
  kSequential,  // each stage to its commit before the next frame: identical bytes on every run
  kParallel,    // mapping in a thread of its own, newest version wins: for live use
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
  int pending_keyframes = 3;  // parallel mode: keyframes that may wait for mapping before the caller waits for it

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("threads", self.threads, Range{0, 256}, "", "threads for loops over cameras; 0 = what the machine has");
    visitor("pending_keyframes", self.pending_keyframes, Range{1, 1000}, "", "keyframes that may wait for mapping in parallel mode");
  }
};

struct Config {
  int seed = 1;
  bool final_adjustment = true;  // global bundle adjustment at the end
  Mode mode = Mode::kParallel;
  IoOptions io;
  ExecutionOptions execution;
  feature::FeatureOptions features;
  frame::BundlingOptions bundling;
  tracking::TrackingOptions tracking;
  mapping::MappingOptions mapping;

  mapping::FeatureModel feature_model() const { return {features.sigma_px, features.scale_factor}; }

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("seed", self.seed, Range{0, 2147483647}, "", "of all randomness");
    visitor("final_adjustment", self.final_adjustment, Range{}, "", "global bundle adjustment at the end");
    visitor("mode", self.mode, Range{}, "", "when stages run");
    visitor.section("io", self.io);
    visitor.section("execution", self.execution);
    visitor.section("features", self.features);
    visitor.section("bundling", self.bundling);
    visitor.section("tracking", self.tracking);
    visitor.section("mapping", self.mapping);
  }
};

}  // namespace bslam::system

template <>
struct bslam::EnumNames<bslam::system::Mode> {
  static constexpr EnumName<system::Mode> kNames[] = {{system::Mode::kSequential, "sequential"},
                                                      {system::Mode::kParallel, "parallel"}};
};
