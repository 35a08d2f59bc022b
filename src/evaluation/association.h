// Which poses of an estimate and of a ground truth belong together: nearest in time.
#pragma once

#include <cstddef>
#include <vector>

#include "evaluation/trajectory.h"

namespace bslam::evaluation {

// Positions in the two trajectories of poses at (nearly) the same time.
struct Association {
  std::size_t estimate = 0;
  std::size_t ground_truth = 0;
};

// Pairs nearest in time and no further apart than `max_dt_ns`, in order of time. Nothing is interpolated: a ground
// truth of higher rate gives the sample nearest to each estimate, as the tools of the field do. The poses of the
// shorter trajectory (of equal ones: the estimate) each look for the nearest of the longer, the earlier one where two
// are equally near. Each estimate is used at most once; where several ground-truth poses ask for the same, the nearest
// has it.
std::vector<Association> associate(const Trajectory& estimate, const Trajectory& ground_truth, TimeNs max_dt_ns);

// Position of the pose nearest in time to `time_ns`, the earlier one of two equally near. The trajectory is not empty.
std::size_t nearest_in_time(const Trajectory& trajectory, TimeNs time_ns);

// Median time between consecutive poses; 0 for fewer than two poses.
TimeNs median_interval_ns(const Trajectory& trajectory);

// Length of the path through all positions, in metres.
double path_length_m(const Trajectory& trajectory);

// The poses of another frame fixed to the moving one: T_world_other = T_world_frame * T_frame_other for each.
Trajectory moved_to_frame(const Trajectory& trajectory, const geometry::SE3& T_frame_other);

}  // namespace bslam::evaluation
