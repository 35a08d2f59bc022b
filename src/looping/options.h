// What steers place recognition, loop closing and relocalisation; gathered in system::Config.
#pragma once

#include "base/options.h"
#include "mapping/landmark_fusion.h"
#include "solver/absolute_pose.h"
#include "solver/pose_graph.h"

namespace bslam::looping {

struct RecognitionOptions {
  double common_share = 0.6;  // of the most common words any keyframe has: fewer, and it is no candidate
  double group_share = 0.75;  // of the best group's score that another group must reach
  double rival_share = 0.25;  // of both where nothing is known of a frame: what looks the same elsewhere must come up
                              // as well, also where fewer keyframes show it
  int group = 10;             // covisible keyframes whose scores add up
  int neighbour_weight = 15;  // shared landmarks, and ...
  double neighbour_share =
      0.05;  // ... of all a keyframe observes, that make another its neighbour: one whose place it knows
  int max_candidates = 5;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("common_share", self.common_share, Range{0, 1}, "",
            "of the most common words, that a candidate must share");
    visitor("group_share", self.group_share, Range{0, 1}, "",
            "of the best group's score, that a candidate's must reach");
    visitor("rival_share", self.rival_share, Range{0, 1}, "", "of both shares, where a frame may be anywhere");
    visitor("group", self.group, Range{1, 100}, "", "covisible keyframes whose scores add up");
    visitor("neighbour_weight", self.neighbour_weight, Range{1, 10000}, "",
            "shared landmarks that make a keyframe a neighbour, no candidate");
    visitor("neighbour_share", self.neighbour_share, Range{0, 1}, "", "of all landmarks of a keyframe, likewise");
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
  double min_found_share =
      0.2;  // of the landmarks that should be found then: fewer agree where two places look alike in part
  double max_turn = 0.52;  // rad: one known only from directions farther aside need not be found
  solver::AbsolutePoseOptions consensus;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("neighbours", self.neighbours, Range{0, 100}, "",
            "covisible keyframes whose landmarks are looked for as well");
    visitor("max_landmarks", self.max_landmarks, Range{10, 100000}, "", "landmarks looked for at most");
    visitor("max_hamming", self.max_hamming, Range{1, 256}, "bits", "largest descriptor distance of a match");
    visitor("ratio", self.ratio, Range{0.1, 1}, "", "best to second best feature of the frame");
    visitor("radius", self.radius, Range{1e-4, 1}, "rad", "guided search at the pose found");
    visitor("min_inliers", self.min_inliers, Range{6, 10000}, "", "keypoints that must support the pose in the end");
    visitor("min_found_share", self.min_found_share, Range{0, 1}, "",
            "of the landmarks that should be found, that must be");
    visitor("max_turn", self.max_turn, Range{0.01, 1.05}, "rad",
            "from the directions it is known from, a landmark should be found");
    visitor.section("consensus", self.consensus);
  }
};

struct LoopOptions {
  bool enabled = true;
  int consistent_keyframes = 2;  // keyframes in a row that must recognise one place
  int max_keyframe_gap = 3;      // from one of them to the next, in keyframes
  double min_news = 0.25;        // of what is seen of the place, that the keyframe must not know yet
  double max_apart = 0.2;   // distance to the place, of that to what is seen of it: from farther off it is no return
  double max_drift = 0.05;  // of the way since the place was last seen: a larger correction is no drift but a mistake
  double max_drift_free = 0.3;  // the same where the scale is not observable
  double near_px = 4.0;         // error of what is seen of the place, up to which bundle adjustment needs no help
  int edge_weight = 60;         // shared landmarks that make two keyframes neighbours in the pose graph
  int window = 10;              // covisible keyframes of the newest that are fused with the place
  mapping::LandmarkFusionOptions fusion{.radius = 0.01, .max_hamming = 60, .max_chi2 = 16.0};
  solver::PoseGraphOptions pose_graph;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("enabled", self.enabled, Range{}, "", "loop closing and the joining of parts");
    visitor("consistent_keyframes", self.consistent_keyframes, Range{1, 100}, "",
            "keyframes in a row that must recognise one place");
    visitor("max_keyframe_gap", self.max_keyframe_gap, Range{1, 100}, "",
            "keyframes from one of them to the next at most");
    visitor("min_news", self.min_news, Range{0, 1}, "",
            "of what is seen of the place, that the keyframe must not know yet");
    visitor("max_apart", self.max_apart, Range{0, 100}, "", "distance to the place, of that to what is seen of it");
    visitor("max_drift", self.max_drift, Range{0, 10}, "",
            "of the way since the place was seen, that a correction may be");
    visitor("max_drift_free", self.max_drift_free, Range{0, 10}, "", "the same where the scale is not observable");
    visitor("near_px", self.near_px, Range{0, 1000}, "px",
            "error of what is seen of the place, up to which bundle adjustment needs no help");
    visitor("edge_weight", self.edge_weight, Range{1, 10000}, "", "shared landmarks of neighbours in the pose graph");
    visitor("window", self.window, Range{0, 100}, "", "covisible keyframes that are fused with the place");
    visitor.section("fusion", self.fusion);
    visitor.section("pose_graph", self.pose_graph);
  }
};

struct RecoveryOptions {
  int new_part_after =
      50;  // frames with something to see but without a pose, after which a new part of the map is begun

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("new_part_after", self.new_part_after, Range{1, 1000000}, "frames",
            "with something to see but without a pose, after which a new part of the map is begun");
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
