#include "arrays.h"

namespace bslam::python {

Rows8 rows_of(const Trajectory& trajectory) {
  std::vector<double> values;
  values.reserve(8 * trajectory.size());
  for (const TimedPose& pose : trajectory) {
    values.push_back(1e-9 * static_cast<double>(pose.time_ns));
    values.insert(values.end(), pose.T_world_frame.translation.begin(), pose.T_world_frame.translation.end());
    values.insert(values.end(), pose.T_world_frame.rotation.begin(), pose.T_world_frame.rotation.end());
  }
  return make_array<Rows8>(std::move(values), {trajectory.size(), 8});
}

}  // namespace bslam::python
