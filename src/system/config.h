// All options of a run: one struct per stage, with default values.
#pragma once

#include "base/options.h"
#include "base/result.h"
#include "calibration/rig_refinement.h"
#include "execution/options.h"
#include "feature/extractor.h"
#include "looping/options.h"
#include "mapping/options.h"
#include "matching/bundling.h"
#include "tracking/camera_health.h"
#include "tracking/options.h"

namespace bslam::tracking {
struct TrackerOptions;
}

namespace bslam::system {

struct IoOptions {
  // Seconds. At least a tenth of the interval of camera 0 is used if a camera captures in phase with it
  // (image/capture_phase.h).
  double sync_tolerance = 0.002;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("sync_tolerance", self.sync_tolerance, Range{0, 1}, "s",
            "maximum time difference between the images of a frame", kCommon);
  }
};

struct Config {
  int seed = 1;
  bool final_adjustment = true;  // global bundle adjustment at the end
  bool localize_only = false;    // localise in a loaded map, which is not changed
  execution::Mode mode = execution::Mode::kParallel;
  IoOptions io;
  execution::ExecutionOptions execution;
  tracking::HealthOptions health;
  feature::FeatureOptions features;
  matching::BundlingOptions bundling;
  tracking::TrackingOptions tracking;
  mapping::MappingOptions mapping;
  looping::LoopingOptions looping;
  calibration::CalibrationOptions calibration;

  feature::FeatureModel feature_model() const { return features.model(); }

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("seed", self.seed, Range{0, 2147483647}, "", "seed of all random numbers", kCommon);
    visitor("final_adjustment", self.final_adjustment, Range{}, "", "global bundle adjustment at the end", kCommon);
    visitor("localize_only", self.localize_only, Range{}, "", "localise in a loaded map, which is not changed",
            kCommon);
    visitor("mode", self.mode, Range{}, "", "when background stages run", kCommon);
    visitor.section("io", self.io);
    visitor.section("execution", self.execution);
    visitor.section("health", self.health);
    visitor.section("features", self.features);
    visitor.section("bundling", self.bundling);
    visitor.section("tracking", self.tracking);
    visitor.section("mapping", self.mapping);
    visitor.section("looping", self.looping);
    visitor.section("calibration", self.calibration);
  }
};

// Cameras `first` to `first` + `size` - 1 of the rig of a map are those of the run; size 0: all cameras.
struct CamerasOfRun {
  std::size_t first = 0, size = 0;
};

// The settings of a run that keeps the calibration as given: it is neither estimated nor checked. A map that serves
// several rigs keeps theirs.
Config without_calibration(Config config);

// The options of the front end.
tracking::TrackerOptions tracker_options(const Config& config, CamerasOfRun cameras = {});

// Returns an Error with the key, without a file, if options contradict each other or a required loaded map is missing.
Status check_config(const Config& config, bool with_map);

}  // namespace bslam::system
