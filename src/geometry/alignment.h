// Least-squares alignment of two point sets.
#pragma once

#include <optional>
#include <span>

#include "geometry/sim3.h"

namespace bslam::geometry {

enum class ScaleMode { kFixed, kFree };

// Returns the T_dst_src that minimises sum |dst_i - T src_i|^2 (Umeyama, PAMI 1991). The scale is 1 if `scale` is
// kFixed. The spans must have the same size. Returns nullopt for fewer than three points or if the points do not
// determine the rotation (all on one line).
std::optional<Sim3> align_points(std::span<const Vector3d> src, std::span<const Vector3d> dst, ScaleMode scale);

}  // namespace bslam::geometry
