// What steers place recognition, loop closing and relocalisation; gathered in system::Config.
#pragma once

#include "base/options.h"
#include "mapping/landmark_fusion.h"
#include "solver/absolute_pose.h"
#include "solver/pose_graph.h"

namespace bslam::looping {

struct RecognitionOptions {
  double min_common_word_ratio = 0.6;   // of the most common words any keyframe has: fewer, and it is no candidate
  double min_group_score_ratio = 0.75;  // of the best group's score that another group must reach
  double relocalisation_factor = 0.25;  // of both where nothing is known of a frame: what looks the same elsewhere must
                                        // come up as well, also where fewer keyframes show it
  int group = 10;             // covisible keyframes whose scores add up
  int min_neighbour_landmarks = 15;  // shared landmarks, and ...
  double min_neighbour_ratio =
      0.05;  // ... of all a keyframe observes, that make another its neighbour: one whose place it knows
  int max_candidates = 5;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("min_common_word_ratio", self.min_common_word_ratio, Range{0, 1}, "",
            "of the most common words, that a candidate must share", OptionNote{.formerly = "common_share"});
    visitor("min_group_score_ratio", self.min_group_score_ratio, Range{0, 1}, "",
            "of the best group's score, that a candidate's must reach", OptionNote{.formerly = "group_share"});
    visitor("relocalisation_factor", self.relocalisation_factor, Range{0, 1}, "",
            "of both shares, where a frame may be anywhere", OptionNote{.formerly = "rival_share"});
    visitor("group", self.group, Range{1, 100}, "", "covisible keyframes whose scores add up");
    visitor("min_neighbour_landmarks", self.min_neighbour_landmarks, Range{1, 10000}, "",
            "shared landmarks that make a keyframe a neighbour, no candidate",
            OptionNote{.formerly = "neighbour_weight"});
    visitor("min_neighbour_ratio", self.min_neighbour_ratio, Range{0, 1}, "",
            "of all landmarks of a keyframe, likewise", OptionNote{.formerly = "neighbour_share"});
    visitor("max_candidates", self.max_candidates, Range{1, 100}, "", "places looked at closely");
  }
};

struct VerificationOptions {
  int neighbours = 10;  // covisible keyframes whose landmarks are looked for with the candidate's
  int max_landmarks = 3000;
  int max_hamming = 60;  // bits
  double ratio = 0.85;   // best to second best feature of the frame
  double radius = 0.02;  // rad: guided search at the pose found
  int min_inliers = 50;  // keypoints that must support the pose in the end
  double min_found_ratio =
      0.2;  // of the landmarks that should be found then: fewer agree where two places look alike in part
  double max_viewing_angle = 0.52;  // rad: one known only from directions farther aside need not be found
  solver::AbsolutePoseOptions consensus;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("neighbours", self.neighbours, Range{0, 100}, "",
            "covisible keyframes whose landmarks are looked for as well");
    visitor("max_landmarks", self.max_landmarks, Range{10, 100000}, "", "landmarks looked for at most");
    visitor("max_hamming", self.max_hamming, Range{1, 256}, "bits", "largest descriptor distance of a match");
    visitor("ratio", self.ratio, Range{0.1, 1}, "", "best to second best feature of the frame");
    visitor("radius", self.radius, Range{1e-4, 1}, "rad", "guided search at the pose found");
    visitor("min_inliers", self.min_inliers, Range{6, 10000}, "", "keypoints that must support the pose in the end",
            kCommon);
    visitor("min_found_ratio", self.min_found_ratio, Range{0, 1}, "",
            "of the landmarks that should be found, that must be", OptionNote{.formerly = "min_found_share"});
    visitor("max_viewing_angle", self.max_viewing_angle, Range{0.01, 1.05}, "rad",
            "from the directions it is known from, a landmark should be found", OptionNote{.formerly = "max_turn"});
    visitor.section("consensus", self.consensus);
  }
};

struct LoopOptions {
  bool enabled = true;
  int consistent_keyframes = 2;  // keyframes in a row that must recognise one place
  int max_keyframe_gap = 3;      // from one of them to the next, in keyframes
  double min_new_landmark_ratio = 0.25;  // of what is seen of the place, that the keyframe must not know yet
  double max_distance_over_depth =
      0.2;                  // distance to the place, of that to what is seen of it: from farther off it is no return
  double max_drift = 0.05;  // of the way since the place was last seen: a larger correction is no drift but a mistake
  double max_drift_free = 0.3;  // the same where the scale is not observable
  double max_bundle_error_px = 4.0;  // error of what is seen of the place, up to which bundle adjustment needs no help
  int edge_weight = 60;         // shared landmarks that make two keyframes neighbours in the pose graph
  int window = 10;              // covisible keyframes of the newest that are fused with the place
  mapping::LandmarkFusionOptions fusion{.radius = 0.01, .max_hamming = 60, .max_chi2 = 16.0};
  solver::PoseGraphOptions pose_graph;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("enabled", self.enabled, Range{}, "", "loop closing and the joining of parts", kCommon);
    visitor("consistent_keyframes", self.consistent_keyframes, Range{1, 100}, "",
            "keyframes in a row that must recognise one place", kCommon);
    visitor("max_keyframe_gap", self.max_keyframe_gap, Range{1, 100}, "",
            "keyframes from one of them to the next at most");
    visitor("min_new_landmark_ratio", self.min_new_landmark_ratio, Range{0, 1}, "",
            "of what is seen of the place, that the keyframe must not know yet", OptionNote{.formerly = "min_news"});
    visitor("max_distance_over_depth", self.max_distance_over_depth, Range{0, 100}, "",
            "distance to the place, of that to what is seen of it", OptionNote{.formerly = "max_apart"});
    visitor("max_drift", self.max_drift, Range{0, 10}, "",
            "of the way since the place was seen, that a correction may be");
    visitor("max_drift_free", self.max_drift_free, Range{0, 10}, "", "the same where the scale is not observable");
    visitor("max_bundle_error_px", self.max_bundle_error_px, Range{0, 1000}, "px",
            "error of what is seen of the place, up to which bundle adjustment needs no help",
            OptionNote{.formerly = "near_px"});
    visitor("edge_weight", self.edge_weight, Range{1, 10000}, "", "shared landmarks of neighbours in the pose graph");
    visitor("window", self.window, Range{0, 100}, "", "covisible keyframes that are fused with the place");
    visitor.section("fusion", self.fusion);
    visitor.section("pose_graph", self.pose_graph);
  }
};

struct RecoveryOptions {
  int new_submap_after =
      50;  // frames with something to see but without a pose, after which a new part of the map is begun

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("new_submap_after", self.new_submap_after, Range{1, 1000000}, "frames",
            "with something to see but without a pose, after which a new part of the map is begun",
            OptionNote{.common = true, .formerly = "new_part_after"});
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
