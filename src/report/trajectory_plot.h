// Plots of an estimated trajectory, with ground truth or without.
#pragma once

#include <string>

#include "evaluation/trajectory.h"
#include "evaluation/trajectory_error.h"

namespace bslam::report {

struct TrajectoryPlotInput {
  std::string title, subtitle;
  evaluation::Trajectory estimate;            // in the world of the ground truth
  evaluation::Trajectory ground_truth;        // may be empty
  std::vector<evaluation::PoseError> errors;  // position error over time; may be empty
};

// What `bslam eval --plot` draws: the aligned estimate against the ground truth, and its error.
TrajectoryPlotInput evaluation_plot_input(const evaluation::TrajectoryEvaluation& evaluation,
                                          const evaluation::Trajectory& ground_truth, std::string title);

// SVG with the path from above and from the side (same scale on both axes) and, where there are errors, the position
// error over time. Which axis is up is not in a trajectory: it is taken to be z, but y where the path extends less than
// half as far along y as along z, as in the worlds of camera frames. Lines are broken where poses are missing.
std::string trajectory_plot_svg(const TrajectoryPlotInput& input);

}  // namespace bslam::report
