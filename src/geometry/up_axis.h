// The upward direction, as the user names it. Images alone do not show gravity.
#pragma once

#include <span>
#include <string>

#include "base/result.h"
#include "geometry/se3.h"

namespace bslam::geometry {

// A direction of camera 0 or of the body, which is upward on average, or of the world of the trajectory.
struct UpAxis {
  enum class Frame { kCamera, kBody, kWorld };
  Frame frame = Frame::kCamera;
  Vector3d direction = {0, -1, 0};  // unit
};

// Parses FRAME:AXIS with FRAME camera, body or world, and AXIS x, y, z, -x, -y, -z or three numbers with commas between
// them: "body:z", "camera:-y", "world:0.1,-0.9,0".
Result<UpAxis> parse_up_axis(const std::string& text);

// The unit vector in the world: the mean direction over the poses, or the axis itself if it is of the world.
// `T_body_cam0` is used for axes of the body. Error: the direction has no mean, since the rig turned all around.
Result<Vector3d> up_in_world(const UpAxis& axis, std::span<const SE3> T_world_cam0, const SE3& T_body_cam0);

}  // namespace bslam::geometry
