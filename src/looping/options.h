// Options of place recognition, loop closing and relocalisation; part of system::Config.
#pragma once

#include "base/options.h"
#include "estimators/absolute_pose.h"
#include "looping/pose_graph.h"
#include "mapping/landmark_fusion.h"

namespace bslam::looping {

struct RecognitionOptions {
  // minimum number of common words of a candidate, relative to the largest number of any keyframe
  double min_common_word_ratio = 0.6;
  double min_group_score_ratio = 0.75;  // minimum score of a group, relative to the best group
  // Factor on min_common_word_ratio and min_group_score_ratio for relocalisation, so that look-alike places become
  // candidates too, even if fewer keyframes observe them.
  double relocalisation_factor = 0.25;
  int group = 10;                    // covisible keyframes whose scores are added up
  int min_neighbour_landmarks = 15;  // minimum number of landmarks shared with a neighbour
  // Minimum fraction of a keyframe's landmarks that makes another keyframe its neighbour; neighbours are not
  // candidates.
  double min_neighbour_ratio = 0.05;
  int max_candidates = 5;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("min_common_word_ratio", self.min_common_word_ratio, Range{0, 1}, "",
            "minimum number of common words of a candidate, relative to the largest number",
            OptionNote{.formerly = "common_share"});
    visitor("min_group_score_ratio", self.min_group_score_ratio, Range{0, 1}, "",
            "minimum score of a candidate group, relative to the best group", OptionNote{.formerly = "group_share"});
    visitor("relocalisation_factor", self.relocalisation_factor, Range{0, 1}, "",
            "factor on min_common_word_ratio and min_group_score_ratio for frames without a pose prior",
            OptionNote{.formerly = "rival_share"});
    visitor("group", self.group, Range{1, 100}, "", "covisible keyframes whose scores are added up");
    visitor("min_neighbour_landmarks", self.min_neighbour_landmarks, Range{1, 10000}, "",
            "minimum number of landmarks shared with a neighbouring keyframe, which is not a candidate",
            OptionNote{.formerly = "neighbour_weight"});
    visitor("min_neighbour_ratio", self.min_neighbour_ratio, Range{0, 1}, "",
            "minimum fraction of the keyframe's landmarks shared with a neighbour; both minima must be met",
            OptionNote{.formerly = "neighbour_share"});
    visitor("max_candidates", self.max_candidates, Range{1, 100}, "", "maximum number of candidates to verify");
  }
};

struct VerificationOptions {
  int neighbours = 10;  // covisible keyframes of the candidate whose landmarks are matched as well
  int max_landmarks = 3000;
  int max_hamming = 60;  // bits
  double ratio = 0.85;   // maximum ratio of best to second best descriptor distance
  double radius = 0.02;  // rad: radius of the guided search at the estimated pose
  int min_inliers = 50;  // minimum number of inlier keypoints
  // Minimum fraction of the landmarks predicted visible that must be matched, or of the features of the frame if it has
  // fewer of them, as in a place that was seen for long. Places that look partly alike match fewer.
  double min_found_ratio = 0.2;
  // rad: only landmarks whose mean viewing direction differs by at most this from the current one count as predicted
  // visible. If these are fewer than min_inliers, the limit is 1.05 rad.
  double max_viewing_angle = 0.52;
  estimators::AbsolutePoseOptions consensus;
  solver::PoseSolverOptions pose;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("neighbours", self.neighbours, Range{0, 100}, "",
            "covisible keyframes of the candidate whose landmarks are matched as well");
    visitor("max_landmarks", self.max_landmarks, Range{10, 100000}, "", "maximum number of landmarks matched");
    visitor("max_hamming", self.max_hamming, Range{1, 256}, "bits", "maximum descriptor distance of a match");
    visitor("ratio", self.ratio, Range{0.1, 1}, "", "maximum ratio of best to second best descriptor distance");
    visitor("radius", self.radius, Range{1e-4, 1}, "rad", "radius of the guided search at the estimated pose");
    visitor("min_inliers", self.min_inliers, Range{6, 10000}, "", "minimum number of inlier keypoints", kCommon);
    visitor(
        "min_found_ratio", self.min_found_ratio, Range{0, 1}, "",
        "minimum fraction of the landmarks predicted visible, or of the features if these are fewer, that must match",
        OptionNote{.formerly = "min_found_share"});
    visitor("max_viewing_angle", self.max_viewing_angle, Range{0.01, 1.05}, "rad",
            "largest angle to the mean viewing direction at which a landmark is predicted visible",
            OptionNote{.formerly = "max_turn"});
    visitor.section("consensus", self.consensus);
    visitor.section("pose", self.pose);
  }
};

struct LoopOptions {
  bool enabled = true;
  int consistent_keyframes = 2;          // successive recognitions of the same place before a loop is accepted
  int max_keyframe_gap = 3;              // largest difference of keyframe ids between two successive recognitions
  double min_new_landmark_ratio = 0.25;  // minimum fraction of matched landmarks not already observed by the keyframe
  // Maximum distance to the matched keyframe over the median distance to the matched landmarks; farther away is no
  // revisit.
  double max_distance_over_depth = 0.2;
  // Maximum translation of the correction, relative to the length of the shortest way to the place along the edges of
  // the pose graph (the spanning tree, and edge_weight) plus the median depth of the scene; a larger one is a false
  // match, not drift.
  double max_drift = 0.05;
  double max_drift_free = 0.3;  // the same maximum in maps whose scale is not metric
  // In metric maps, loops with a smaller reprojection error are corrected without a pose graph.
  double max_bundle_error_px = 4.0;
  int edge_weight = 60;  // minimum number of shared landmarks for a covisibility edge of the pose graph
  int window = 10;       // covisible keyframes of the newest one whose landmarks are fused with those of the place
  mapping::LandmarkFusionOptions fusion{.radius = 0.01, .max_hamming = 60, .max_chi2 = 16.0};
  PoseGraphOptions pose_graph;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("enabled", self.enabled, Range{}, "", "loop closing and merging of submaps", kCommon);
    visitor("consistent_keyframes", self.consistent_keyframes, Range{1, 100}, "",
            "successive recognitions of the same place before a loop is accepted", kCommon);
    visitor("max_keyframe_gap", self.max_keyframe_gap, Range{1, 100}, "",
            "largest difference of keyframe ids between two successive recognitions of a place");
    visitor("min_new_landmark_ratio", self.min_new_landmark_ratio, Range{0, 1}, "",
            "minimum fraction of matched landmarks not already observed by the keyframe",
            OptionNote{.formerly = "min_news"});
    visitor("max_distance_over_depth", self.max_distance_over_depth, Range{0, 100}, "",
            "maximum distance to the matched keyframe over the median distance to the matched landmarks",
            OptionNote{.formerly = "max_apart"});
    visitor(
        "max_drift", self.max_drift, Range{0, 10}, "",
        "maximum correction relative to the length of the shortest way to the place along the edges of the pose graph, "
        "plus the scene depth");
    visitor("max_drift_free", self.max_drift_free, Range{0, 10}, "", "max_drift in maps whose scale is not metric");
    visitor("max_bundle_error_px", self.max_bundle_error_px, Range{0, 1000}, "px",
            "reprojection error up to which a loop of a metric map is corrected without a pose graph",
            OptionNote{.formerly = "near_px"});
    visitor("edge_weight", self.edge_weight, Range{1, 10000}, "",
            "minimum number of shared landmarks for a covisibility edge of the pose graph");
    visitor("window", self.window, Range{0, 100}, "",
            "covisible keyframes of the newest one whose landmarks are fused with those of the place");
    visitor.section("fusion", self.fusion);
    visitor.section("pose_graph", self.pose_graph);
  }
};

struct RecoveryOptions {
  // Number of frames with enough features but without a pose after which a new submap is started.
  int new_submap_after = 20;
  // A new submap is also started after this time without a pose, in s, if there were at least five such frames.
  double new_submap_after_s = 2.0;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("new_submap_after", self.new_submap_after, Range{1, 1000000}, "frames",
            "number of frames with features but without a pose after which a new submap is started",
            OptionNote{.common = true, .formerly = "new_part_after"});
    visitor("new_submap_after_s", self.new_submap_after_s, Range{0, 1e6}, "s",
            "a new submap is also started after this time without a pose, if there were five such frames",
            OptionNote{.common = true});
  }
};

struct LoopingOptions {
  RecognitionOptions recognition;
  VerificationOptions verification;
  LoopOptions loop;
  RecoveryOptions recovery;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor.section("recognition", self.recognition);
    visitor.section("verification", self.verification);
    visitor.section("loop", self.loop);
    visitor.section("recovery", self.recovery);
  }
};

}  // namespace bslam::looping
