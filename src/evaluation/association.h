// Association of the poses of an estimate with the poses of a ground truth by their timestamps.
#pragma once

#include <cstddef>
#include <vector>

#include "evaluation/trajectory.h"

namespace bslam::evaluation {

// Indices of associated poses in the two trajectories.
struct Association {
  std::size_t estimate = 0;
  std::size_t ground_truth = 0;
};

// Returns pairs of poses at most `max_dt_ns` apart, in order of time. Nothing is interpolated: if the ground truth has
// a higher rate, the nearest sample is used, as in common evaluation tools. Each pose of the shorter trajectory (the
// estimate, if they are equally long) is paired with the nearest pose in time of the longer trajectory; the earlier one
// on ties. Each estimated pose is used at most once: if several ground-truth poses select it, the nearest is kept.
std::vector<Association> associate(const Trajectory& estimate, const Trajectory& ground_truth, TimeNs max_dt_ns);

// Returns the index of the pose nearest in time to `time_ns`; the earlier one on ties. The trajectory must not be
// empty.
std::size_t nearest_in_time(const Trajectory& trajectory, TimeNs time_ns);

// Returns the median time between consecutive poses; 0 if there are fewer than two poses.
TimeNs median_interval_ns(const Trajectory& trajectory);

// Returns the length of the path through all positions, in metres.
double path_length_m(const Trajectory& trajectory);

// Converts the trajectory to another frame fixed to the moving one: T_world_other = T_world_frame * T_frame_other.
Trajectory moved_to_frame(const Trajectory& trajectory, const geometry::SE3& T_frame_other);

// Moves the path of a camera and the ground truth of another frame to one frame: that of the ground truth or, if the
// unit of the estimate is not the metre, in which the distance to that frame is known, the camera of the estimate.
// Returns the distance in metres by which the ground truth was moved; 0 if it was not.
double move_to_one_frame(const geometry::SE3& T_cam_truth, bool metric, Trajectory& estimate, Trajectory& truth);

}  // namespace bslam::evaluation
