// Options of local mapping; part of system::Config.
#pragma once

#include "adjustment/map_adjustment.h"
#include "base/options.h"
#include "mapping/landmark_fusion.h"

namespace bslam::mapping {

struct CreationOptions {
  int neighbours = 6;                     // covisible keyframes matched for new landmarks
  double min_baseline_over_depth = 0.01;  // minimum distance of two cameras relative to the median depth
  int max_hamming = 50;                   // bits, maximum descriptor distance
  double ratio = 0.8;                     // maximum ratio of best to second best distance along the epipolar curve
  double min_parallax = 0.012;            // rad, minimum angle between the rays of a new landmark
  double max_depth_error = 0.15;          // maximum relative standard deviation of its depth
  double max_chi2 = 5.991;                // maximum squared normalised error of each of its keypoints

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("neighbours", self.neighbours, Range{0, 100}, "", "covisible keyframes matched for new landmarks");
    visitor("min_baseline_over_depth", self.min_baseline_over_depth, Range{0, 1}, "",
            "minimum distance of two cameras relative to the median depth",
            OptionNote{.formerly = "min_baseline_share"});
    visitor("max_hamming", self.max_hamming, Range{1, 256}, "bits",
            "maximum descriptor distance of a new landmark's features");
    visitor("ratio", self.ratio, Range{0.1, 1}, "",
            "maximum ratio of best to second best distance along the epipolar curve");
    visitor("min_parallax", self.min_parallax, Range{0, 1}, "rad", "minimum parallax of a new landmark");
    visitor("max_depth_error", self.max_depth_error, Range{0.001, 10}, "",
            "maximum relative depth error of a new landmark");
    visitor("max_chi2", self.max_chi2, Range{0.1, 1000}, "",
            "maximum squared normalised error of each keypoint of a new landmark");
  }
};

struct FusionOptions {
  int neighbours = 10;        // covisible keyframes to search for duplicates
  int second_neighbours = 3;  // covisible keyframes of each of these to search as well
  int max_targets = 20;
  mapping::LandmarkFusionOptions search;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("neighbours", self.neighbours, Range{0, 100}, "", "covisible keyframes searched for duplicates");
    visitor("second_neighbours", self.second_neighbours, Range{0, 100}, "",
            "covisible keyframes of each of these neighbours that are searched as well");
    visitor("max_targets", self.max_targets, Range{0, 1000}, "", "maximum number of keyframes searched");
    mapping::LandmarkFusionOptions::visit(self.search, visitor);
  }
};

struct CullingOptions {
  int probation = 3;              // number of keyframes during which a new landmark is checked
  double min_found_ratio = 0.25;  // minimum ratio of frames that matched it to frames that predicted it visible
  int min_keypoints = 3;          // minimum number of its keypoints after the probation
  // A keyframe is redundant if more than this fraction of its landmarks is observed by `redundant_views` other
  // keyframes.
  double redundant_ratio = 0.9;
  int redundant_views = 3;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("probation", self.probation, Range{1, 100}, "keyframes",
            "number of keyframes during which a new landmark is checked");
    visitor("min_found_ratio", self.min_found_ratio, Range{0, 1}, "",
            "minimum ratio of frames that matched a landmark to frames that predicted it visible",
            OptionNote{.formerly = "min_found_share"});
    visitor("min_keypoints", self.min_keypoints, Range{1, 100}, "",
            "minimum number of keypoints of a landmark after its probation");
    visitor("redundant_ratio", self.redundant_ratio, Range{0, 1}, "",
            "fraction of landmarks observed by others above which a keyframe is redundant",
            OptionNote{.common = true, .formerly = "redundant_share"});
    visitor("redundant_views", self.redundant_views, Range{1, 100}, "",
            "number of other keyframes that must observe a landmark to count it in redundant_ratio");
  }
};

struct LocalWindowOptions {
  int free_keyframes = 12;   // the newest keyframe and its best covisible ones
  int fixed_keyframes = 24;  // other keyframes that observe their landmarks, held fixed
  int max_landmarks = 4000;  // maximum number of adjusted landmarks; those with most observations are chosen

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("free_keyframes", self.free_keyframes, Range{1, 1000}, "",
            "number of free keyframes in an adjustment: the newest one and its best covisible keyframes", kCommon);
    visitor("fixed_keyframes", self.fixed_keyframes, Range{1, 1000}, "",
            "number of fixed keyframes in an adjustment: other keyframes that observe its landmarks");
    visitor("max_landmarks", self.max_landmarks, Range{10, 1000000}, "", "maximum number of landmarks adjusted",
            kCommon);
  }
};

// Estimation of the metric scale for rigs whose cameras do not overlap.
struct ScaleOptions {
  double max_deviation = 0.02;  // relative standard deviation below which the map becomes metric
  // Relative standard deviation above which the map is not rescaled.
  double max_correcting_deviation = 0.3;
  int keyframes = 40;     // maximum number of keyframes used to estimate the scale
  int min_keyframes = 6;  // minimum number before the map can become metric; outliers are hard to detect among few
  int rounds = 4;         // rounds of scale estimation and adjustment per keyframe while the scale changes
  double converged_change = 0.05;       // relative change of the scale below which no further round follows
  double sigma_rotation_deg = 0.5;      // standard deviation of calibrated rotations, per axis
  double correlated_observations = 10;  // number of observations that carry as much information as one

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("max_deviation", self.max_deviation, Range{1e-4, 1}, "",
            "relative standard deviation of the scale below which the map becomes metric");
    visitor("max_correcting_deviation", self.max_correcting_deviation, Range{1e-4, 10}, "",
            "relative standard deviation of the scale below which the map is rescaled");
    visitor("keyframes", self.keyframes, Range{2, 1000}, "",
            "keyframes used to estimate the scale; submaps up to this size are adjusted as a whole");
    visitor("min_keyframes", self.min_keyframes, Range{2, 1000}, "",
            "minimum number of keyframes before the map can become metric");
    visitor("rounds", self.rounds, Range{1, 20}, "", "rounds of scale estimation and adjustment per keyframe");
    visitor("converged_change", self.converged_change, Range{0, 1}, "",
            "relative change of the scale below which no further round follows", OptionNote{.formerly = "settled"});
    visitor("sigma_rotation_deg", self.sigma_rotation_deg, Range{0, 20}, "deg",
            "standard deviation of calibrated rotations, per axis");
    visitor("correlated_observations", self.correlated_observations, Range{1, 1e4}, "",
            "number of observations that carry as much information as one");
  }
};

struct MappingOptions {
  CreationOptions creation;
  FusionOptions fusion;
  CullingOptions culling;
  LocalWindowOptions window;
  ScaleOptions scale;
  adjustment::AdjustmentOptions local{.relative_decrease = 1e-3};  // the next keyframe continues the adjustment
  // After a loop closure the remaining error is distributed over the whole map, which changes the cost only slightly;
  // hence the stricter convergence threshold.
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
