// What steers local mapping; gathered in system::Config.
#pragma once

#include "adjustment/map_adjustment.h"
#include "base/options.h"
#include "mapping/landmark_fusion.h"

namespace bslam::mapping {

struct CreationOptions {
  int neighbours = 6;                // covisible keyframes whose free features are compared
  double min_baseline_share = 0.01;  // of the median depth: closer keyframes show no depth
  int max_hamming = 50;              // bits
  double ratio = 0.8;                // best to second best along the epipolar curve
  double min_parallax = 0.012;       // rad, between the rays of a new landmark
  double max_depth_error = 0.15;     // relative standard deviation of its depth
  double max_chi2 = 5.991;           // of each of its keypoints

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("neighbours", self.neighbours, Range{0, 100}, "", "covisible keyframes whose free features are compared");
    visitor("min_baseline_share", self.min_baseline_share, Range{0, 1}, "",
            "of the median depth: closer keyframes show no depth");
    visitor("max_hamming", self.max_hamming, Range{1, 256}, "bits",
            "largest descriptor distance of a new landmark's features");
    visitor("ratio", self.ratio, Range{0.1, 1}, "", "best to second best along the epipolar curve");
    visitor("min_parallax", self.min_parallax, Range{0, 1}, "rad", "least parallax of a new landmark");
    visitor("max_depth_error", self.max_depth_error, Range{0.001, 10}, "", "relative depth error of a new landmark");
    visitor("max_chi2", self.max_chi2, Range{0.1, 1000}, "", "squared normalised error of each of its keypoints");
  }
};

struct FusionOptions {
  int neighbours = 10;        // covisible keyframes, and ...
  int second_neighbours = 3;  // ... of each of these as many again
  int max_targets = 20;
  mapping::LandmarkFusionOptions search;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("neighbours", self.neighbours, Range{0, 100}, "", "covisible keyframes searched for duplicates");
    visitor("second_neighbours", self.second_neighbours, Range{0, 100}, "", "of each of these as many again");
    visitor("max_targets", self.max_targets, Range{0, 1000}, "", "keyframes searched at most");
    mapping::LandmarkFusionOptions::visit(self.search, visitor);
  }
};

struct CullingOptions {
  int probation = 3;              // keyframes after which a new landmark must have proven itself
  double min_found_share = 0.25;  // frames that found it, of those that should have
  int min_keypoints = 3;          // that observe it after the probation
  double redundant_share = 0.9;   // of a keyframe's landmarks seen by `redundant_views` others: it goes
  int redundant_views = 3;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("probation", self.probation, Range{1, 100}, "keyframes",
            "after which a new landmark must have proven itself");
    visitor("min_found_share", self.min_found_share, Range{0, 1}, "",
            "frames that found a landmark, of those that should have");
    visitor("min_keypoints", self.min_keypoints, Range{1, 100}, "", "that observe a landmark after its probation");
    visitor("redundant_share", self.redundant_share, Range{0, 1}, "",
            "share of landmarks seen elsewhere that makes a keyframe redundant");
    visitor("redundant_views", self.redundant_views, Range{1, 100}, "", "other keyframes that must see them");
  }
};

struct LocalWindowOptions {
  int free_keyframes = 12;   // the newest and its best covisible keyframes
  int fixed_keyframes = 24;  // further observers of their landmarks, which hold the window in place
  int max_landmarks = 4000;  // those seen most often take part

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("free_keyframes", self.free_keyframes, Range{1, 1000}, "",
            "keyframes adjusted: the newest and its best covisible ones");
    visitor("fixed_keyframes", self.fixed_keyframes, Range{1, 1000}, "",
            "further observers that hold the window in place");
    visitor("max_landmarks", self.max_landmarks, Range{10, 1000000}, "", "landmarks adjusted at most");
  }
};

// The metric scale of rigs whose cameras do not overlap.
struct ScaleOptions {
  double max_deviation = 0.02;            // relative, below which a map may call itself metric
  double max_correcting_deviation = 0.3;  // above it the unit the map began with is as good a guess
  int keyframes = 40;                     // that take part in a measurement of the scale
  int min_keyframes = 6;                  // of them before the map may be metric: outliers hide among few
  int rounds = 4;                         // of measuring and adjusting at one keyframe, while the unit changes much
  double settled = 0.05;                  // relative change of the unit that asks for no further round

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("max_deviation", self.max_deviation, Range{1e-4, 1}, "",
            "relative, below which a map may call itself metric");
    visitor("max_correcting_deviation", self.max_correcting_deviation, Range{1e-4, 10}, "",
            "relative, below which the map is scaled");
    visitor("keyframes", self.keyframes, Range{2, 1000}, "",
            "keyframes that measure the scale, and up to which all are adjusted");
    visitor("min_keyframes", self.min_keyframes, Range{2, 1000}, "", "keyframes a metric map needs");
    visitor("rounds", self.rounds, Range{1, 20}, "", "of measuring and adjusting at one keyframe");
    visitor("settled", self.settled, Range{0, 1}, "", "relative change of the unit that asks for no further round");
  }
};

struct MappingOptions {
  CreationOptions creation;
  FusionOptions fusion;
  CullingOptions culling;
  LocalWindowOptions window;
  ScaleOptions scale;
  adjustment::AdjustmentOptions local;
  // What a loop leaves to be shared out bends the whole map a little: the cost hardly tells, so it is followed further.
  adjustment::AdjustmentOptions global{.robust_iterations = 10, .final_iterations = 10, .relative_decrease = 1e-7};

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor.section("creation", self.creation);
    visitor.section("fusion", self.fusion);
    visitor.section("culling", self.culling);
    visitor.section("window", self.window);
    visitor.section("scale", self.scale);
    visitor.section("local", self.local);
    visitor.section("global", self.global);
  }
};

using feature::FeatureModel;

}  // namespace bslam::mapping
