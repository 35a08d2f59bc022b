// Do the images of a whole run agree with the calibrated extrinsics? Part of a finished map is adjusted with the
// extrinsics free; how far they move is a check of the calibration, and where wanted a better one.
#pragma once

#include <array>
#include <stop_token>
#include <vector>

#include "base/options.h"
#include "map/bundled_map.h"

namespace bslam::calibration {

struct RigRefinementOptions {
  bool check = true;     // at the end of a run: says which cameras are not where the calibration has them
  bool refine = false;   // at the end of a run: the extrinsics found are accepted
  int keyframes = 120;   // at most; in stretches all over the map
  int landmarks = 6000;  // at most; spread over stretches and cameras
  double calibration_deg = 2.0, calibration_mm = 30.0;  // standard deviations per axis of the calibrated extrinsics
  // A camera is suspect that has turned or moved by more than both: standard deviations, and degrees or millimetres.
  // The latter allow for what the deviations do not contain: intrinsics a little wrong, and times: a camera stamped 1
  // ms late looks displaced by 10 mm at 10 m/s and turned by 0.1 degrees at 100 degrees/s.
  double suspect_sigmas = 5.0, suspect_deg = 0.3, suspect_mm = 10.0;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("check", self.check, Range{}, "",
            "at the end, find out which cameras are not where the calibration has them");
    visitor("refine", self.refine, Range{}, "", "at the end, accept the extrinsics that suit the map best");
    visitor("keyframes", self.keyframes, Range{10, 500}, "", "keyframes used at most");
    visitor("landmarks", self.landmarks, Range{100, 1e5}, "", "landmarks used at most");
    visitor("calibration_deg", self.calibration_deg, Range{1e-3, 20}, "deg",
            "standard deviation of calibrated rotations, per axis");
    visitor("calibration_mm", self.calibration_mm, Range{1e-3, 1e4}, "mm",
            "standard deviation of calibrated translations, per axis");
    visitor("suspect_sigmas", self.suspect_sigmas, Range{1, 100}, "",
            "standard deviations a suspect camera has moved by at least");
    visitor("suspect_deg", self.suspect_deg, Range{0, 180}, "deg", "and degrees");
    visitor("suspect_mm", self.suspect_mm, Range{0, 1e5}, "mm", "or millimetres");
  }
};

// One camera; camera 0 is the rig and does not move.
struct CameraRefinement {
  geometry::SE3 T_cam_rig_after;
  double change_deg = 0, change_mm = 0;                // by which the camera turned and its centre moved
  double std_deg = 0, std_mm = 0;                      // of T_cam_rig_after, in the direction in which they are largest
  double rotation_sigmas = 0, translation_sigmas = 0;  // the changes in standard deviations, directions accounted for
  // Rotation about, then translation along the camera's axes: what the images tell, rather than the calibration alone.
  std::array<bool, 6> observed = {};
  int observations = 0;  // keypoints
  bool suspect = false;

  bool rotation_observed() const { return observed[0] && observed[1] && observed[2]; }
  bool translation_observed() const { return observed[3] && observed[4] && observed[5]; }
};

struct RigRefinement {
  bool done = false;  // false: one camera alone, no metric scale, too little to learn from, stopped or failed
  std::vector<CameraRefinement> cameras;     // all, in the order of the rig, where done
  std::size_t keyframes = 0, landmarks = 0;  // used
};

// Chooses and adjusts; the map stays as it is. `features` as for adjust_map. Deterministic. Takes
// time: seconds with the default options.
RigRefinement refine_rig(const map::BundledMap& map, const RigRefinementOptions& options,
                         const feature::FeatureModel& features, std::stop_token stop = {});

// The rig with the extrinsics found; camera 0 stays where it is in the body. As it was where nothing was found.
camera::Rig refined(const camera::Rig& rig, const RigRefinement& refinement);

}  // namespace bslam::calibration
