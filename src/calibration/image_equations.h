// What each image says about the extrinsics of its camera, with everything else constant.
#pragma once

#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "calibration/rig_problem.h"
#include "solver/reprojection.h"

namespace bslam::calibration {

inline constexpr int kMinObservations = 20;  // of an image that determines the extrinsics of its camera
inline constexpr int kMinKeyframes = 3;      // with enough observations, before and after a change of a camera

// The normal equations of the extrinsics of a camera (a left perturbation of T_cam_rig, rad and metres), from its
// observations in one or several keyframes. Errors are in standard deviations.
struct ImageEquations {
  geometry::Matrix6d H = geometry::Matrix6d::Zero();
  geometry::Vector6d b = geometry::Vector6d::Zero();
  double squared_errors = 0;  // sum, weighted by the kernel of Huber
  int observations = 0;
  int keyframes = 0;  // with enough observations to determine the extrinsics

  bool enough() const { return keyframes > 0; }
  void add(const ImageEquations& other);
};

// Maximum squared normalised error of observations that are used.
inline constexpr double kMaxUsedChi2 = 16 * solver::kChi2TwoDof95;

// Per pose and camera of a problem, (poses, cameras) row-major. Gross outliers are ignored.
std::vector<ImageEquations> image_equations(const RigProblem& problem, const solver::RigValues& values);

// The change of the extrinsics of the part `after` relative to the rest of `all` that decreases the cost most, and
// twice that decrease.
std::pair<geometry::Vector6d, double> best_change(const ImageEquations& all, const ImageEquations& after);

// Number of observations of an image that carry as much information about the extrinsics of its camera as one
// observation whose error is independent of the others: about 1 if the errors of an image are independent, and up to
// the number of its observations if they are those of one displacement of the camera, such as by a wrong time stamp.
// Determined from successive images of each camera, so that errors of the calibration, which are the same in all
// images, and moves of cameras count little (docs/math.md, section 16). 1 if there are too few images.
double correlation_in_images(const map::BundledMap& map, const RigProblem& problem, const solver::RigValues& values);

// The camera of the problem whose images contradict each other as a whole from one image to the next, far more than
// those of the other cameras do: its focal length changes, its images are stabilised, its mount is loose, or its time
// stamps are wrong. No calibration explains it. Returns nullopt if there is none.
std::optional<std::size_t> unsteady_camera(const map::BundledMap& map, const RigProblem& problem,
                                           const solver::RigValues& values);

}  // namespace bslam::calibration
