// Extrinsic self-calibration: a part of a finished map is adjusted with free extrinsics. Their change shows whether the
// calibration agrees with the images, and can be accepted as a better calibration.
#pragma once

#include <array>
#include <stop_token>
#include <vector>

#include "base/options.h"
#include "map/bundled_map.h"

namespace bslam::calibration {

struct RigRefinementOptions {
  bool check = true;     // at the end of a run, report cameras whose estimated extrinsics differ from the calibration
  bool refine = false;   // at the end of a run, accept the estimated extrinsics
  int keyframes = 120;   // maximum number, in segments of consecutive keyframes distributed over the map
  int landmarks = 6000;  // maximum number, distributed over segments and cameras
  double calibration_deg = 2.0, calibration_mm = 30.0;  // standard deviations per axis of the calibrated extrinsics
  // A camera is suspect if its rotation or translation changed by more than both a number of standard deviations and an
  // absolute threshold. The latter allows for errors that the standard deviations do not include, such as slightly
  // wrong intrinsics and timestamps: a camera with a time offset of 1 ms appears displaced by 10 mm at 10 m/s and
  // rotated by 0.1 degrees at 100 degrees/s.
  double suspect_sigmas = 5.0, suspect_deg = 0.3, suspect_mm = 10.0;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("check", self.check, Range{}, "",
            "at the end of a run, report cameras whose estimated extrinsics differ from the calibration", kCommon);
    visitor("refine", self.refine, Range{}, "", "at the end of a run, accept the estimated extrinsics", kCommon);
    visitor("keyframes", self.keyframes, Range{10, 500}, "", "maximum number of keyframes used");
    visitor("landmarks", self.landmarks, Range{100, 1e5}, "", "maximum number of landmarks used");
    visitor("calibration_deg", self.calibration_deg, Range{1e-3, 20}, "deg",
            "standard deviation of calibrated rotations, per axis");
    visitor("calibration_mm", self.calibration_mm, Range{1e-3, 1e4}, "mm",
            "standard deviation of calibrated translations, per axis");
    visitor("suspect_sigmas", self.suspect_sigmas, Range{1, 100}, "",
            "a suspect camera changed by more than this number of standard deviations");
    visitor("suspect_deg", self.suspect_deg, Range{0, 180}, "deg", "and rotated by more than this");
    visitor("suspect_mm", self.suspect_mm, Range{0, 1e5}, "mm", "or moved by more than this");
  }
};

// The result for one camera. Camera 0 defines the rig frame and does not move.
struct CameraRefinement {
  geometry::SE3 T_cam_rig_after;
  double change_deg = 0, change_mm = 0;  // rotation angle, and displacement of the camera centre
  double std_deg = 0, std_mm = 0;  // standard deviations of T_cam_rig_after in the direction of largest uncertainty
  double rotation_sigmas = 0, translation_sigmas = 0;  // changes in standard deviations (Mahalanobis distance)
  // Rotation around, then translation along the camera's axes: true if the images, and not only the calibration,
  // constrain it.
  std::array<bool, 6> observed = {};
  int observations = 0;  // number of keypoints
  bool suspect = false;

  bool rotation_observed() const { return observed[0] && observed[1] && observed[2]; }
  bool translation_observed() const { return observed[3] && observed[4] && observed[5]; }
};

struct RigRefinement {
  bool done = false;  // false: one camera only, no metric scale, too few observations, stopped or failed
  std::vector<CameraRefinement> cameras;     // all cameras in the order of the rig, if done
  std::size_t keyframes = 0, landmarks = 0;  // numbers used
};

// Selects keyframes and landmarks and adjusts them; the map is not changed. `features` as in adjust_map. Deterministic.
// Takes seconds with the default options.
RigRefinement refine_rig(const map::BundledMap& map, const RigRefinementOptions& options,
                         const feature::FeatureModel& features, std::stop_token stop = {});

// Returns the rig with the estimated extrinsics; camera 0 keeps its pose in the body. Returns `rig` unchanged if
// nothing was estimated.
camera::Rig refined(const camera::Rig& rig, const RigRefinement& refinement);

}  // namespace bslam::calibration
