#include <bslam/pose.h>
#include <bslam/trajectory.h>
#include <fmt/format.h>

#include <algorithm>

#include "api/conversions.h"
#include "api/guard.h"
#include "base/atomic_file.h"
#include "camera/camera_description.h"
#include "evaluation/trajectory_file.h"

namespace bslam {

Matrix4 Pose::matrix() const {
  const std::vector<double> rows = camera::rows_of(api::to_se3(*this));
  Matrix4 out;
  std::copy_n(rows.begin(), out.size(), out.begin());
  return out;
}

Pose Pose::inverse() const { return api::to_pose(api::to_se3(*this).inverse()); }

Result<Pose> Pose::from_matrix(const Matrix4& rows) {
  const auto T = camera::rigid_transform(std::vector<double>(rows.begin(), rows.end()), "Pose::from_matrix", "");
  if (!T) return T.error();
  return api::to_pose(*T);
}

Pose operator*(const Pose& T_a_b, const Pose& T_b_c) { return api::to_pose(api::to_se3(T_a_b) * api::to_se3(T_b_c)); }

std::array<double, 3> operator*(const Pose& T_a_b, const std::array<double, 3>& point_b) {
  const geometry::Vector3d p = api::to_se3(T_a_b) * geometry::Vector3d(point_b[0], point_b[1], point_b[2]);
  return {p.x(), p.y(), p.z()};
}

Status write_tum(const std::filesystem::path& file, const Trajectory& trajectory, RigFrame frame,
                 std::string_view parent) {
  return api::guarded("write_tum", [&]() -> Status {
    if (parent.empty() || parent.find_first_of(" \t\r\n") != std::string_view::npos)
      return Error{"write_tum", "parent", fmt::format("'{}'", parent), "the name of a frame, without spaces"};
    evaluation::Trajectory poses;
    for (const TimedPose& p : trajectory) poses.push_back({p.time_ns, api::to_se3(p.T_world_frame)});
    const char* name = frame == RigFrame::kBody ? "body" : "cam0";
    const std::string header = evaluation::trajectory_header(name, evaluation::PoseState::kFinal, parent);
    return write_atomically(file, evaluation::tum_text(poses, header));
  });
}

}  // namespace bslam
