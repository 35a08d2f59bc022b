// Self-calibration: a part of a map is adjusted with free extrinsics and intrinsics. Their change shows whether the
// calibration agrees with the images, and can be accepted as a better calibration.
#pragma once

#include <array>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "base/options.h"
#include "calibration/rig_bundle_adjustment.h"
#include "calibration/time_jump.h"
#include "map/map_edit.h"

namespace bslam::calibration {

// Whether the images contradict the calibration. kUnknown: too few observations to decide.
enum class Verdict { kUnknown, kConsistent, kInconsistent };
std::string_view verdict_name(Verdict verdict);  // "unknown", "consistent", "inconsistent"

enum class Refine {
  kFalse,  // the calibration is constant, as in the paper
  kAuto,   // it is replaced by the estimate as soon as the images contradict it
  kTrue,   // it is always replaced by the estimate
};

struct CalibrationOptions {
  Refine refine = Refine::kAuto;
  bool check = true;      // at the end of a run, estimate the calibration and report differences
  int keyframes = 2000;   // maximum number, in segments of consecutive keyframes that are distributed over the map
  int landmarks = 20000;  // maximum number, distributed over segments and cameras
  // Standard deviations of the given calibration: the prior of the estimate. Extrinsics: per axis. Focal lengths
  // and their ratio: relative. Principal points: per axis, of the image width. Distortion: of the model table
  // (camera/model_table.h).
  double sigma_rotation_deg = 2.0;
  double sigma_translation_mm = 2.0, sigma_translation_percent = 1.0;  // added in quadrature
  // Additional standard deviation of translations along the optical axes (solver::ExtrinsicPrior)
  double sigma_depth_mm = 5.0;
  double sigma_scale_percent = 0.5;  // of the common scale of all baselines, which the images do not determine
  // During a run, the map keeps its scale while it differs from that of the calibrated baselines by less than this, or
  // by less than the standard deviation of the estimate.
  double scale_tolerance_percent = 1.5;
  double sigma_focal_percent = 1.0, sigma_aspect_percent = 0.1, sigma_centre_percent = 0.5;
  // Standard deviations of the given time offsets and readout times of rolling shutters. These are kept constant unless
  // the images contradict them by more than `suspect_ms`.
  double sigma_time_offset_ms = 5.0, sigma_readout_ms = 10.0;
  // Number of observations that carry as much information as one, because the errors of a landmark in successive images
  // are similar. At least the number that the errors within images show (correlation_in_images).
  double correlated_observations = 10;
  // The images contradict the calibration if it increases their mean squared error by more than this fraction.
  double inconsistent_excess = 0.1;
  // A camera is suspect if its rotation or translation changed by more than both a number of standard deviations and an
  // absolute threshold. The latter allows for errors that the standard deviations do not include, such as slightly
  // wrong timestamps: a camera with a time offset of 1 ms appears displaced by 10 mm at 10 m/s and rotated by 0.1
  // degrees at 100 degrees/s.
  double suspect_sigmas = 5.0, suspect_deg = 0.3, suspect_mm = 10.0;
  double suspect_ms = 0.5;  // absolute threshold for time offsets and readout times

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("refine", self.refine, Range{}, "",
            "replace the calibration by an estimate from the images: false: never; auto: if they contradict it; true: "
            "always",
            OptionNote{.common = true, .formerly = "extrinsics.refine"});
    visitor("check", self.check, Range{}, "",
            "at the end of a run, estimate the calibration and report cameras that differ from it",
            OptionNote{.common = true, .formerly = "extrinsics.check"});
    visitor("keyframes", self.keyframes, Range{10, 1e5}, "", "maximum number of keyframes used",
            OptionNote{.formerly = "extrinsics.keyframes"});
    visitor("landmarks", self.landmarks, Range{100, 1e6}, "", "maximum number of landmarks used",
            OptionNote{.formerly = "extrinsics.landmarks"});
    visit_deviations(self, visitor);
    visitor(
        "scale_tolerance_percent", self.scale_tolerance_percent, Range{0, 100}, "%",
        "during a run, smaller changes of the map's scale are not applied, nor changes within its standard deviation");
    visitor("correlated_observations", self.correlated_observations, Range{1, 1e4}, "",
            "number of observations that carry as much information as one; more if the images show it");
    visitor("inconsistent_excess", self.inconsistent_excess, Range{0, 100}, "",
            "the images contradict a calibration that increases the mean squared error by more than this fraction");
    visitor("suspect_sigmas", self.suspect_sigmas, Range{1, 100}, "",
            "a suspect camera changed by more than this number of standard deviations",
            OptionNote{.formerly = "extrinsics.suspect_sigmas"});
    visitor("suspect_deg", self.suspect_deg, Range{0, 180}, "deg",
            "minimum rotation of a suspect camera, in addition to suspect_sigmas",
            OptionNote{.formerly = "extrinsics.suspect_deg"});
    visitor("suspect_mm", self.suspect_mm, Range{0, 1e5}, "mm",
            "minimum displacement of a suspect camera, in addition to suspect_sigmas",
            OptionNote{.formerly = "extrinsics.suspect_mm"});
    visitor("suspect_ms", self.suspect_ms, Range{0, 1e3}, "ms",
            "time offsets and readout times are only refined if the images contradict them by more than this");
  }

 private:
  template <class Self, class Visitor>
  static void visit_deviations(Self& self, Visitor& visitor) {
    visitor("sigma_rotation_deg", self.sigma_rotation_deg, Range{1e-3, 20}, "deg",
            "standard deviation of calibrated rotations, per axis",
            OptionNote{.formerly = "extrinsics.calibration_deg"});
    visitor("sigma_translation_mm", self.sigma_translation_mm, Range{1e-3, 1e4}, "mm",
            "standard deviation of calibrated translations, per axis",
            OptionNote{.formerly = "extrinsics.calibration_mm"});
    visitor("sigma_translation_percent", self.sigma_translation_percent, Range{0, 100}, "%",
            "added in quadrature: a part in percent of the longest distance of a camera from camera 0");
    visitor("sigma_depth_mm", self.sigma_depth_mm, Range{0, 1e4}, "mm",
            "added in quadrature: a part along the optical axes of the camera and of camera 0");
    visitor("sigma_scale_percent", self.sigma_scale_percent, Range{1e-3, 100}, "%",
            "standard deviation of the common scale of all baselines");
    visitor("sigma_focal_percent", self.sigma_focal_percent, Range{1e-3, 50}, "%",
            "standard deviation of calibrated focal lengths");
    visitor("sigma_aspect_percent", self.sigma_aspect_percent, Range{1e-3, 50}, "%",
            "standard deviation of the ratio of calibrated focal lengths, fx / fy");
    visitor("sigma_centre_percent", self.sigma_centre_percent, Range{1e-3, 50}, "%",
            "standard deviation of calibrated principal points, per axis, in percent of the image width");
    visitor("sigma_time_offset_ms", self.sigma_time_offset_ms, Range{1e-6, 1e3}, "ms",
            "standard deviation of calibrated time offsets");
    visitor("sigma_readout_ms", self.sigma_readout_ms, Range{1e-6, 1e3}, "ms",
            "standard deviation of calibrated readout times of rolling shutters");
  }
};

// A parameter of a camera model.
struct ParameterRefinement {
  std::string name;
  double change = 0, std = 0;
  bool observed = false;
};

// A time of a camera that was estimated.
struct TimeRefinement {
  double change_ms = 0, std_ms = 0;
  bool refined = false;  // false: it is constant
};

// The result for one camera. Camera 0 defines the rig frame and does not move.
struct CameraRefinement {
  double change_deg = 0, change_mm = 0;  // rotation angle, and displacement of the camera centre
  double std_deg = 0, std_mm = 0;        // standard deviations of the pose in the direction of largest uncertainty
  double rotation_sigmas = 0, translation_sigmas = 0;  // changes in standard deviations (Mahalanobis distance)
  // Rotation around, then translation along the camera's axes: true if the images, and not only the calibration,
  // constrain it.
  std::array<bool, 6> observed = {};
  double unobserved_mm = 0;  // length of the part of the displacement in directions that the images do not constrain
  std::vector<ParameterRefinement> intrinsics;
  TimeRefinement time_offset, readout;  // the time offset of camera 0 is constant
  int observations = 0;                 // number of keypoints
  bool suspect = false;

  bool rotation_observed() const { return observed[0] && observed[1] && observed[2]; }
  bool translation_observed() const { return observed[3] && observed[4] && observed[5]; }
};

// A camera that was moved relative to the others during the recording (camera::CameraMove). Its extrinsics changed by a
// rotation angle and a displacement of its centre, with standard deviations in the direction of largest uncertainty.
struct MoveEstimate {
  std::size_t camera = 0;
  TimeNs time_ns = 0;  // of the first keyframe after the move
  double change_deg = 0, std_deg = 0, change_mm = 0, std_mm = 0;
  double rotation_sigmas = 0, translation_sigmas = 0;  // Mahalanobis distances
};

struct RigRefinement {
  bool done = false;  // false: several cameras without metric scale, too few observations, stopped or failed
  // Some camera was displaced by much that the images do not constrain, its time stamps changed, or its images
  // contradict each other; never accepted.
  bool implausible = false;
  std::optional<TimeJump> jump;              // its time stamps seem to have changed during the run
  std::optional<std::size_t> unsteady;       // the camera whose images contradict each other (unsteady_camera)
  std::vector<CameraRefinement> cameras;     // all cameras in the order of the rig, if done
  std::vector<MoveEstimate> moves;           // in order of time; the extrinsics in `cameras` are those before them
  std::size_t keyframes = 0, landmarks = 0;  // numbers of keyframes and landmarks used
  double excess_error = 0;                   // of the given calibration (RigAdjustment)
  Verdict verdict = Verdict::kUnknown;
  // If done: the estimated rig, and the poses and landmarks that belong to it, of the keyframes and landmarks used.
  std::optional<camera::Rig> rig;
  RigInformation information;  // information of the estimate, to combine it with estimates from other maps
  double scale_change = 1;     // factor by which the lengths of the map change
  // Standard deviation of scale_change due to the error of the calibration; 0 if it is not known.
  double scale_deviation = 0;
  double kept_scale = 1;  // factor by which keep_scale() multiplied the baselines
  map::SetPoses poses;    // poses of keyframes after the change of scale
};

// Selects keyframes and landmarks and adjusts them with free calibration, beginning with the rig of the map; the map is
// not changed. `calibrated`: the given calibration, from which changes are counted. `features` as in adjust_map.
// `first`: the first keyframe of this run; those before it are of a map that was loaded. Deterministic. Takes seconds
// with the default options, and longer if a camera was moved.
RigRefinement refine_rig(const map::BundledMap& map, const camera::Rig& calibrated, const CalibrationOptions& options,
                         const feature::FeatureModel& features, std::stop_token stop = {},
                         KeyframeId first = KeyframeId(0));

// The inverse of the covariance of the given calibration, (n, n), in the unknowns of RigInformation.
Eigen::MatrixXd prior_information(const camera::Rig& calibrated, const CalibrationOptions& options);

// Whether the rig of a map is to be replaced by the estimate.
bool accepted(const RigRefinement& refinement, const CalibrationOptions& options);
// Whether an earlier estimate has replaced the calibration of a map. An accepted estimate always changes extrinsics
// and the intrinsics of camera 0.
bool replaced(const camera::Rig& of_map, const camera::Rig& calibrated);
// Returns the result of refine_rig if the estimate is to be accepted. If that depends on the verdict, the verdict is
// determined first from a fraction of the keyframes and landmarks.
std::optional<RigRefinement> refine_if_accepted(const map::BundledMap& map, const camera::Rig& calibrated,
                                                const CalibrationOptions& options,
                                                const feature::FeatureModel& features, const std::stop_token& stop = {},
                                                KeyframeId first = KeyframeId(0));
// Moves the submap of a keyframe as a whole so that the keyframe has the given pose. The origin of the world frame is
// the original pose of the root. The displacement of the root is therefore an error of all keyframes, and is added to
// their uncertainty.
void move_submap(KeyframeId keyframe, const geometry::SE3& T_rig_world, map::MapDraft& draft);
// Replaces the rig of the draft's map by the estimate, with the poses and landmarks that belong to it; all others have
// to be adjusted afterwards. The refinement must be done, and its map the draft's.
void apply(const RigRefinement& refinement, map::MapDraft& draft);

}  // namespace bslam::calibration

template <>
struct bslam::EnumNames<bslam::calibration::Refine> {
  static constexpr EnumName<calibration::Refine> kNames[] = {{calibration::Refine::kFalse, "false"},
                                                             {calibration::Refine::kAuto, "auto"},
                                                             {calibration::Refine::kTrue, "true"}};
};
