// Warnings about an estimated calibration that differs from the given one.
#pragma once

#include <string>
#include <vector>

#include "calibration/rig_refinement.h"

namespace bslam::calibration {

// One line for each camera and each of: focal lengths or principal points that differ by much, a focal length or a
// distortion that differs by more than errors of calibrations do, and images that contradict the times of the camera.
// `rig`: the given calibration of the estimate's cameras. All but the times only if the images contradict it; nothing
// for a camera whose time stamps changed during the run or whose images contradict each other.
std::vector<std::string> deviation_warnings(const camera::Rig& rig, const RigRefinement& estimate);

// Says that the time stamps of a camera changed during the run. `when`: "12.3 s", for example.
std::string time_jump_text(const std::string& camera, const TimeJump& jump, const std::string& when);

// Says that the images of a camera contradict each other.
std::string unsteady_text(const std::string& camera);

// Says by how much the estimated extrinsics of a camera differ.
std::string extrinsics_text(const std::string& camera, double change_deg, double change_mm);

// Says by how much the images contradict the calibration.
std::string contradiction_text(const RigRefinement& estimate);

}  // namespace bslam::calibration
