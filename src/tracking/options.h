// What steers tracking; gathered in system::Config.
#pragma once

#include "base/options.h"
#include "map/local_view.h"
#include "matching/patch_alignment.h"
#include "solver/pose_solver.h"

namespace bslam::tracking {

struct MatchingOptions {
  double predicted_radius = 0.025;  // rad: where the motion model puts a landmark, it is looked for this far
  double wide_radius = 0.12;        // rad: when that finds too little
  double local_radius = 0.006;      // rad: landmarks of the local view, once the pose is nearly known
  int max_hamming = 80;             // bits
  double ratio = 0.9;               // best to second best descriptor distance on one level

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("predicted_radius", self.predicted_radius, Range{1e-4, 1}, "rad",
            "search radius about the motion model's prediction", kCommon);
    visitor("wide_radius", self.wide_radius, Range{1e-4, 1.5}, "rad", "search radius when that finds too little",
            kCommon);
    visitor("local_radius", self.local_radius, Range{1e-4, 1}, "rad", "search radius once the pose is nearly known");
    visitor("max_hamming", self.max_hamming, Range{1, 256}, "bits", "largest descriptor distance of a match");
    visitor("ratio", self.ratio, Range{0.1, 1}, "", "best to second best descriptor distance on one level");
  }
};

struct KeyframeOptions {
  int min_interval = 2;         // frames between keyframes at least
  int max_interval = 40;        // frames between keyframes at most
  double min_overlap = 0.75;    // landmarks of the reference keyframe still tracked, below which a keyframe is due
  double max_parallax = 0.06;   // rad: median parallax against the reference keyframe above which one is due
  int min_camera_inliers = 40;  // inliers of a camera below which ...
  double min_camera_inlier_ratio = 0.15;  // ... and below this share of its keypoints it asks for a keyframe

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("min_interval", self.min_interval, Range{1, 1000}, "frames", "frames between keyframes at least", kCommon);
    visitor("max_interval", self.max_interval, Range{1, 100000}, "frames", "frames between keyframes at most", kCommon);
    visitor("min_overlap", self.min_overlap, Range{0, 1}, "",
            "share of the reference keyframe's landmarks still tracked", kCommon);
    visitor("max_parallax", self.max_parallax, Range{0, 3}, "rad", "median parallax against the reference keyframe",
            kCommon);
    visitor("min_camera_inliers", self.min_camera_inliers, Range{0, 10000}, "",
            "inliers below which a camera may ask for a keyframe", OptionNote{.formerly = "starved_camera"});
    visitor("min_camera_inlier_ratio", self.min_camera_inlier_ratio, Range{0, 1}, "",
            "share of its keypoints below which it does", OptionNote{.formerly = "starved_share"});
  }
};

struct InitialisationOptions {
  int min_matched = 60;               // features with a metric point that start a map at once
  double max_depth_error = 0.15;      // relative standard deviation of the depth of a point that becomes a landmark
  double min_parallax = 5e-4;         // rad: below it a matched feature has no point
  double max_chi2 = 7.81;             // squared normalised error of a keypoint against its feature's point
  int min_monocular = 80;             // matches between two frames that start a map up to scale
  int min_monocular_points = 50;      // points it needs
  double assumed_median_depth = 3.0;  // metres: median distance of its points, where the rig may tell the scale later
  double max_scale_deviation = 0.3;   // relative, of the distance between the two frames: above it the guess is as good

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("min_matched", self.min_matched, Range{10, 10000}, "",
            "features with a metric point that start a map at once", kCommon);
    visitor("max_depth_error", self.max_depth_error, Range{0.001, 10}, "",
            "relative depth error of a point that becomes a landmark");
    visitor("min_parallax", self.min_parallax, Range{0, 1}, "rad", "least parallax of a feature that gets a point");
    visitor("max_chi2", self.max_chi2, Range{0.1, 1000}, "",
            "squared normalised error of a keypoint against its feature's point");
    visitor("min_monocular", self.min_monocular, Range{10, 10000}, "",
            "matches between two frames that start a map up to scale");
    visitor("min_monocular_points", self.min_monocular_points, Range{10, 10000}, "", "points such a start needs");
    visitor("assumed_median_depth", self.assumed_median_depth, Range{1e-3, 1e4}, "m",
            "median distance of its points where several cameras may tell later",
            OptionNote{.formerly = "guessed_depth"});
    visitor("max_scale_deviation", self.max_scale_deviation, Range{1e-3, 10}, "",
            "relative error of a start's scale above which it is guessed");
  }
};

// Do the cameras of a frame agree?
struct ConsensusOptions {
  int min_expected = 20;  // landmarks a camera should see, below which nothing is said about it
  double min_reobservation_ratio =
      0.1;  // of what it saw in the last frame and should see now: found less, it is doubted ...
  double healthy_reobservation_ratio = 0.4;  // ... while another camera finds this much ...
  double previous_reobservation_ratio =
      0.5;  // ... and it did itself find this much a frame ago: else its view went little by little
  double conflict_inlier_ratio = 0.3;  // of a camera's matches that agree with the pose: fewer contradict it
  double readmission_ratio =
      0.15;                     // of the map's landmarks in its view, found by a doubted camera: it sees what it should
  int readmit_after = 3;        // such frames in a row before it counts again
  double forget_after_s = 2.0;  // without anything it should see, after which it counts again
  double retry_after_s = 10.0;  // out for that long and not seen to show its view displaced, it is tried again

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("min_expected", self.min_expected, Range{1, 10000}, "",
            "landmarks a camera should see, below which nothing is said about it");
    visitor("min_reobservation_ratio", self.min_reobservation_ratio, Range{0, 1}, "",
            "of what a camera saw last: finds it less again, it is doubted", OptionNote{.formerly = "lost_share"});
    visitor("healthy_reobservation_ratio", self.healthy_reobservation_ratio, Range{0, 1}, "",
            "while another camera finds this much", OptionNote{.formerly = "sound_share"});
    visitor("previous_reobservation_ratio", self.previous_reobservation_ratio, Range{0, 1}, "",
            "and it found this much itself a frame ago", OptionNote{.formerly = "steady_share"});
    visitor("conflict_inlier_ratio", self.conflict_inlier_ratio, Range{0, 1}, "",
            "of a camera's matches that agree with the pose: fewer contradict it",
            OptionNote{.formerly = "conflict_share"});
    visitor("readmission_ratio", self.readmission_ratio, Range{0, 1}, "",
            "of the landmarks in its view that a doubted camera must find", OptionNote{.formerly = "seen_share"});
    visitor("readmit_after", self.readmit_after, Range{1, 10000}, "frames", "in a row before it counts again");
    visitor("forget_after_s", self.forget_after_s, Range{0, 1e6}, "s",
            "without anything it should see, after which it counts again");
    visitor("retry_after_s", self.retry_after_s, Range{0, 1e6}, "s",
            "out and not seen to show its view displaced, after which it is tried again");
  }
};

struct TrackingOptions {
  bool use_capture_times = true;  // images count at their own times; false: at that of their frame
  int min_inliers = 30;           // keypoints that must support a pose, all cameras together
  int min_inliers_wide = 50;      // the same after a search without a usable prediction
  double min_inlier_share = 0.3;  // of the matches: fewer agree by chance
  MatchingOptions matching;
  ConsensusOptions consensus;
  KeyframeOptions keyframe;
  InitialisationOptions initialisation;
  matching::AlignmentOptions alignment;
  map::LocalViewOptions local_view;
  solver::PoseSolverOptions pose;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("use_capture_times", self.use_capture_times, Range{}, "",
            "images count at their own times; false: at that of their frame",
            OptionNote{.common = true, .formerly = "own_times"});
    visitor("min_inliers", self.min_inliers, Range{6, 10000}, "", "keypoints that must support a pose", kCommon);
    visitor("min_inliers_wide", self.min_inliers_wide, Range{6, 10000}, "",
            "the same after a search without a prediction");
    visitor("min_inlier_share", self.min_inlier_share, Range{0, 1}, "", "share of the matches that must agree");
    visitor.section("matching", self.matching);
    visitor.section("consensus", self.consensus);
    visitor.section("keyframe", self.keyframe);
    visitor.section("initialisation", self.initialisation);
    visitor.section("alignment", self.alignment);
    visitor.section("local_view", self.local_view);
    visitor.section("pose", self.pose);
  }
};

}  // namespace bslam::tracking
