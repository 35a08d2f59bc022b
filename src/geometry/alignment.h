// Alignment of two point sets in the least-squares sense.
#pragma once

#include <optional>
#include <span>

#include "geometry/sim3.h"

namespace bslam::geometry {

enum class ScaleMode { kFixed, kFree };

// T_dst_src minimising sum |dst_i - T src_i|^2 (Umeyama, PAMI 1991); scale 1 where fixed. Both spans have equal size.
// Empty for fewer than three points or where the rotation is not determined (all points on one line).
std::optional<Sim3> align_points(std::span<const Vector3d> src, std::span<const Vector3d> dst, ScaleMode scale);

}  // namespace bslam::geometry
