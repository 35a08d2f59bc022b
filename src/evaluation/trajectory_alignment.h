// Alignment of an estimated trajectory to the ground truth.
#pragma once

#include <optional>
#include <span>

#include "geometry/alignment.h"

namespace bslam::evaluation {

// Returns the T_dst_src that minimises sum |dst_i - T src_i|^2 over SE(3), or over Sim(3) if the scale is free. Unlike
// geometry::align_points it also handles paths on a line and motionless trajectories, for which the rotation is not
// unique: one of the optimal rotations is returned, and the distances after alignment do not depend on the choice. The
// spans must have the same size and must not be empty. Returns nullopt if the scale is free and one of the paths has no
// extent.
std::optional<geometry::Sim3> align_positions(std::span<const geometry::Vector3d> src,
                                              std::span<const geometry::Vector3d> dst, geometry::ScaleMode scale);

}  // namespace bslam::evaluation
