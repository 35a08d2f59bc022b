// The evidence that a camera is late, as JSON, for the reports of runs and of calibrations.
#pragma once

#include <nlohmann/json.hpp>
#include <utility>

#include "calibration/late_camera.h"

namespace bslam::session {

// `cameras`: an object that names the late camera and the one it was compared with. The evidence is appended to it.
inline nlohmann::ordered_json late_camera_json(nlohmann::ordered_json cameras, const calibration::LateCamera& late) {
  cameras["early"] = late.early;
  cameras["part"] = late.part;
  cameras["matches"] = late.matches;
  cameras["fit"] = late.agreeing;
  cameras["matches_one_frame_apart"] = late.matches_apart;
  cameras["fit_one_frame_apart"] = late.agreeing_apart;
  return cameras;
}

}  // namespace bslam::session
