// Plots of an estimated trajectory, with or without ground truth.
#pragma once

#include <string>
#include <vector>

#include "evaluation/trajectory.h"
#include "evaluation/trajectory_error.h"

namespace bslam::report {

// Direction of the axes of the world frame, which a trajectory itself does not contain.
enum class WorldAxes {
  kUnknown,  // z is up, unless the path extends less than half as far along y as along z: then as kCamera
  kCamera,   // x to the right, y down, z forward, as in the world frame of a run
};

struct TrajectoryPlotInput {
  std::string title, subtitle;
  evaluation::Trajectory estimate;            // in the world frame of the ground truth
  evaluation::Trajectory ground_truth;        // may be empty
  std::vector<evaluation::PoseError> errors;  // position error over time; may be empty
  WorldAxes axes = WorldAxes::kUnknown;
  std::vector<Eigen::Vector3d> landmarks = {};  // in the frame of the estimate; may be empty
};

// Returns the input of the plot of `bslam eval --plot`: aligned estimate, ground truth and position error.
TrajectoryPlotInput evaluation_plot_input(const evaluation::TrajectoryEvaluation& evaluation,
                                          const evaluation::Trajectory& ground_truth, std::string title);

// Returns an SVG document with the path seen from above and from the side, with equal scales on both axes and the
// upward direction up the page, the landmarks except for those far outside, and with the position error over time if
// there is ground truth. Lines are interrupted if poses are missing.
std::string trajectory_plot_svg(const TrajectoryPlotInput& input);

}  // namespace bslam::report
