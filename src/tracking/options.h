// Options of tracking; part of system::Config.
#pragma once

#include "base/options.h"
#include "map/local_view.h"
#include "matching/patch_alignment.h"
#include "solver/pose_solver.h"

namespace bslam::tracking {

struct MatchingOptions {
  double predicted_radius = 0.025;  // rad, search radius around the prediction of the motion model
  // Rad, radius of the second search if that finds too few landmarks, 0.1 s after the last pose.
  double wide_radius = 0.12;
  // Rad, maximum radius of the second search, which grows with the time since the last pose.
  double widest_radius = 0.5;
  double local_radius = 0.006;  // rad, search radius for landmarks of the local view, at the estimated pose
  int max_hamming = 80;         // bits, maximum descriptor distance of a match
  double ratio = 0.9;           // maximum ratio of best to second best descriptor distance on one pyramid level

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("predicted_radius", self.predicted_radius, Range{1e-4, 1}, "rad",
            "search radius around the prediction of the motion model", kCommon);
    visitor("wide_radius", self.wide_radius, Range{1e-4, 1.5}, "rad",
            "radius of a second search if the first finds too few landmarks, up to 0.1 s after the last pose", kCommon);
    visitor("widest_radius", self.widest_radius, Range{1e-4, 1.5}, "rad",
            "maximum of wide_radius, which grows with the time since the last pose");
    visitor("local_radius", self.local_radius, Range{1e-4, 1}, "rad",
            "search radius for landmarks of the local view, at the estimated pose");
    visitor("max_hamming", self.max_hamming, Range{1, 256}, "bits", "maximum descriptor distance of a match");
    visitor("ratio", self.ratio, Range{0.1, 1}, "",
            "maximum ratio of best to second best descriptor distance on one pyramid level");
  }
};

struct KeyframeOptions {
  int min_interval = 2;   // minimum number of frames between keyframes
  int max_interval = 40;  // maximum number of frames between keyframes, unless the rig is at rest
  // A keyframe is inserted if the number of tracked landmarks of the reference keyframe, divided by the largest such
  // number of any frame since that keyframe, is smaller.
  double min_overlap = 0.75;
  double max_parallax = 0.09;  // rad; a keyframe is inserted if the median parallax to the reference keyframe is larger
  int min_camera_inliers = 40;            // a keyframe is inserted if some camera has fewer inliers than this ...
  double min_camera_inlier_ratio = 0.15;  // ... and fewer than this fraction of its keypoints
  // A keyframe is inserted if fewer features with accurate depth than this are tracked ...
  int min_tracked_close = 100;
  int max_untracked_close = 70;  // ... and more than this are not landmarks yet

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("min_interval", self.min_interval, Range{1, 1000}, "frames", "minimum number of frames between keyframes",
            kCommon);
    visitor("max_interval", self.max_interval, Range{1, 100000}, "frames",
            "maximum number of frames between keyframes, unless the rig is at rest", kCommon);
    visitor("min_overlap", self.min_overlap, Range{0, 1}, "",
            "minimum number of tracked landmarks of the reference keyframe, relative to the largest number in a frame "
            "since that keyframe",
            kCommon);
    visitor("max_parallax", self.max_parallax, Range{0, 3}, "rad", "maximum median parallax to the reference keyframe",
            kCommon);
    visitor("min_camera_inliers", self.min_camera_inliers, Range{0, 10000}, "",
            "a keyframe is inserted if a camera has fewer inliers, and fewer than min_camera_inlier_ratio",
            OptionNote{.formerly = "starved_camera"});
    visitor("min_camera_inlier_ratio", self.min_camera_inlier_ratio, Range{0, 1}, "",
            "minimum ratio of inliers to keypoints of a camera with fewer than min_camera_inliers",
            OptionNote{.formerly = "starved_share"});
    visitor("min_tracked_close", self.min_tracked_close, Range{0, 10000}, "",
            "a keyframe is inserted if fewer features with accurate depth are tracked, and max_untracked_close is "
            "exceeded");
    visitor("max_untracked_close", self.max_untracked_close, Range{0, 10000}, "",
            "maximum number of features with accurate depth that are no landmarks yet, with few tracked ones");
  }
};

struct InitialisationOptions {
  int min_matched = 30;           // minimum number of features with an accurate metric point for a metric map
  double max_depth_error = 0.15;  // maximum relative standard deviation of the depth of a new landmark
  double min_parallax = 5e-4;     // rad, minimum parallax of a matched feature for which a point is triangulated
  double max_chi2 = 7.81;         // maximum squared normalised error of a keypoint to its feature's point
  int min_monocular = 80;         // minimum number of matches for a monocular initialisation
  int min_monocular_points = 50;  // minimum number of points of a monocular initialisation
  // M, minimum median distance of the initial points that is assumed if the scale is too uncertain.
  double assumed_median_depth = 3.0;
  double max_scale_deviation = 1.0;  // maximum relative standard deviation of the scale estimated from two frames

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("min_matched", self.min_matched, Range{10, 10000}, "",
            "minimum number of features with an accurate metric point to initialise a metric map", kCommon);
    visitor("max_depth_error", self.max_depth_error, Range{0.001, 10}, "",
            "maximum relative standard deviation of the depth of a new landmark");
    visitor("min_parallax", self.min_parallax, Range{0, 1}, "rad",
            "minimum parallax of a matched feature to triangulate its point");
    visitor("max_chi2", self.max_chi2, Range{0.1, 1000}, "",
            "maximum squared normalised error of a keypoint to its feature's point");
    visitor("min_monocular", self.min_monocular, Range{10, 10000}, "",
            "minimum number of matches between two frames for a monocular initialisation");
    visitor("min_monocular_points", self.min_monocular_points, Range{10, 10000}, "",
            "minimum number of points of a monocular initialisation");
    visitor("assumed_median_depth", self.assumed_median_depth, Range{1e-3, 1e4}, "m",
            "median distance of the initial points that is assumed if the scale of a rig is too uncertain",
            OptionNote{.formerly = "guessed_depth"});
    visitor("max_scale_deviation", self.max_scale_deviation, Range{1e-3, 10}, "",
            "maximum relative standard deviation of the scale estimated at the initialisation");
  }
};

// Consistency between the cameras of a frame (tracking/camera_consensus.h).
struct ConsensusOptions {
  int min_expected = 20;  // minimum number of landmarks (or matches) of a camera to check its consistency
  // A camera is excluded if the fraction of its expected landmarks of the last frame that it re-observes is smaller
  // than this ...
  double min_reobservation_ratio = 0.1;
  // ... while another camera re-observes this fraction. It is also the minimum inlier ratio of a pose estimated from
  // one camera if cameras contradict each other.
  double healthy_reobservation_ratio = 0.4;
  // ... and the camera itself re-observed this fraction in the previous frame; else it lost its landmarks gradually.
  double previous_reobservation_ratio = 0.5;
  double conflict_inlier_ratio = 0.3;  // minimum inlier ratio of a camera's matches; with fewer it contradicts the pose
  double readmission_ratio = 0.15;     // minimum fraction of the landmarks in view that an excluded camera must match
  int readmit_after = 3;               // number of consecutive frames with this fraction until the camera is used again
  double forget_after_s = 2.0;         // an excluded camera with too few landmarks in view for this time is used again
  double retry_after_s = 10.0;         // time after which an excluded camera is used again unless its view is displaced
  // Largest angle by which the calibration may rotate the view of a camera that sees the right scene.
  double max_calibration_error_deg = 4.0;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("min_expected", self.min_expected, Range{1, 10000}, "",
            "minimum number of landmarks of a camera to check its consistency");
    visitor("min_reobservation_ratio", self.min_reobservation_ratio, Range{0, 1}, "",
            "minimum fraction of the landmarks of the last frame that a camera must re-observe",
            OptionNote{.formerly = "lost_share"});
    visitor("healthy_reobservation_ratio", self.healthy_reobservation_ratio, Range{0, 1}, "",
            "a camera is excluded only if another one re-observes this fraction; minimum inlier ratio of a "
            "single-camera pose",
            OptionNote{.formerly = "sound_share"});
    visitor("previous_reobservation_ratio", self.previous_reobservation_ratio, Range{0, 1}, "",
            "a camera is excluded only if it re-observed this fraction in the previous frame",
            OptionNote{.formerly = "steady_share"});
    visitor("conflict_inlier_ratio", self.conflict_inlier_ratio, Range{0, 1}, "",
            "minimum inlier ratio of a camera's matches that does not contradict the pose",
            OptionNote{.formerly = "conflict_share"});
    visitor("readmission_ratio", self.readmission_ratio, Range{0, 1}, "",
            "minimum fraction of the landmarks in view that an excluded camera must match",
            OptionNote{.formerly = "seen_share"});
    visitor("readmit_after", self.readmit_after, Range{1, 10000}, "frames",
            "consecutive frames above readmission_ratio until an excluded camera is used again");
    visitor("forget_after_s", self.forget_after_s, Range{0, 1e6}, "s",
            "time without enough landmarks in view after which an excluded camera is used again");
    visitor("retry_after_s", self.retry_after_s, Range{0, 1e6}, "s",
            "time after which an excluded camera is used again unless its view is displaced");
    visitor("max_calibration_error_deg", self.max_calibration_error_deg, Range{0, 90}, "deg",
            "in a new map, a camera whose view is rotated by up to this angle is used: its calibration is wrong");
  }
};

// How the pose of a frame between keyframes is found.
enum class FrontEnd {
  kFeatures,  // from extracted features, in every frame
  kDirect,    // from landmarks aligned directly in the images; from features where this does not suffice
  kAuto,      // like kDirect, but with features for some frames after the alignment has failed repeatedly
};

// Direct tracking (tracking/track_directly.h).
struct DirectOptions {
  int per_image = 300;  // maximum number of landmarks aligned in an image
  // Maximum number of landmarks aligned in all images of a frame, but at least `min_per_image` in each.
  int per_rig = 600;
  int min_per_image = 100;
  // Number of landmarks with coarse patches that are aligned first; fewer if per_rig limits each image.
  int coarse_per_image = 60;
  // Pixels of the pyramid level, maximum distance of these landmarks from their predicted positions.
  double coarse_shift_px = 4;
  // KeyframeOptions::min_overlap for frames without features. It is larger because landmarks can still be aligned when
  // the rig is too far away to detect them again.
  double min_overlap = 0.85;
  // Features are extracted if a camera has fewer inliers than this fraction of its largest number since the last
  // extraction.
  double min_support = 0.6;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("per_image", self.per_image, Range{50, 20000}, "", "maximum number of landmarks aligned in an image");
    visitor("per_rig", self.per_rig, Range{50, 100000}, "",
            "maximum number of landmarks aligned in all images of a frame; min_per_image takes precedence");
    visitor("min_per_image", self.min_per_image, Range{10, 20000}, "",
            "minimum of the landmarks aligned in an image, if per_rig is divided among many cameras");
    visitor("coarse_per_image", self.coarse_per_image, Range{10, 1000}, "",
            "number of landmarks with coarse patches that are aligned first; fewer if per_rig limits each image");
    visitor("coarse_shift_px", self.coarse_shift_px, Range{0.5, 20}, "px of the level",
            "maximum distance of the landmarks that are aligned first from their predicted positions");
    visitor("min_overlap", self.min_overlap, Range{0, 1}, "",
            "tracking.keyframe.min_overlap for frames without features");
    visitor("min_support", self.min_support, Range{0, 1}, "",
            "features are extracted if a camera has fewer inliers than this fraction of its largest number since the "
            "last extraction");
  }
};

struct TrackingOptions {
  FrontEnd frontend = FrontEnd::kAuto;
  // The cameras of a frame have their own capture times; false: the time of the frame. Estimated time offsets are
  // added.
  bool use_capture_times = true;
  int min_inliers = 30;           // minimum number of inlier keypoints of a pose, all cameras together
  int min_inliers_wide = 50;      // minimum number of inlier keypoints of a pose after a search in wide windows
  double min_inlier_ratio = 0.3;  // minimum ratio of inliers to matches of a pose, lower above 100 inliers
  MatchingOptions matching;
  ConsensusOptions consensus;
  KeyframeOptions keyframe;
  InitialisationOptions initialisation;
  DirectOptions direct;
  matching::AlignmentOptions alignment;
  map::LocalViewOptions local_view;
  solver::PoseSolverOptions pose;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("frontend", self.frontend, Range{}, "",
            "features: features are extracted in every frame; direct: landmarks are aligned directly in the images "
            "between keyframes; auto: like direct, but with features for some frames after repeated failures",
            kCommon);
    visitor("use_capture_times", self.use_capture_times, Range{}, "",
            "use the capture time of each camera; false: the time of the frame",
            OptionNote{.common = true, .formerly = "own_times"});
    visitor("min_inliers", self.min_inliers, Range{6, 10000}, "",
            "minimum number of inlier keypoints of a pose, all cameras together", kCommon);
    visitor("min_inliers_wide", self.min_inliers_wide, Range{6, 10000}, "",
            "minimum number of inlier keypoints after a search in wide windows");
    visitor("min_inlier_ratio", self.min_inlier_ratio, Range{0, 1}, "", "minimum ratio of inliers to matches of a pose",
            OptionNote{.formerly = "min_inlier_share"});
    visitor.section("matching", self.matching);
    visitor.section("consensus", self.consensus);
    visitor.section("keyframe", self.keyframe);
    visitor.section("initialisation", self.initialisation);
    visitor.section("direct", self.direct);
    visitor.section("alignment", self.alignment);
    visitor.section("local_view", self.local_view);
    visitor.section("pose", self.pose);
  }
};

}  // namespace bslam::tracking

template <>
struct bslam::EnumNames<bslam::tracking::FrontEnd> {
  static constexpr EnumName<tracking::FrontEnd> kNames[] = {{tracking::FrontEnd::kFeatures, "features"},
                                                            {tracking::FrontEnd::kDirect, "direct"},
                                                            {tracking::FrontEnd::kAuto, "auto"}};
};
