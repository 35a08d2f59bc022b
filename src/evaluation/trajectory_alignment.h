// The alignment under which positions of two trajectories are compared.
#pragma once

#include <optional>
#include <span>

#include "geometry/alignment.h"

namespace bslam::evaluation {

// T_dst_src minimising sum |dst_i - T src_i|^2 over SE(3), or Sim(3) where the scale is free. Unlike
// geometry::align_points also for paths on one line and for standing still, where rotations about the line, or all, do
// equally well: one of them is taken, and distances after alignment do not depend on which. Both spans have equal size,
// at least one point. Empty where the scale is free and one of the paths has no extent.
std::optional<geometry::Sim3> align_positions(std::span<const geometry::Vector3d> src,
                                              std::span<const geometry::Vector3d> dst, geometry::ScaleMode scale);

}  // namespace bslam::evaluation
