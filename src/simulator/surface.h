// Textured rectangles; the built-in worlds consist of them.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <span>
#include <vector>

#include "simulator/material.h"

namespace bslam::simulator {

using Eigen::Vector2d;
using Eigen::Vector3d;

// A rectangle: the points origin + a u + b v with a and b in [0, 1]. The edges u and v are perpendicular, in metres and
// in the world frame. The normal u x v points to the visible and lit side.
struct Surface {
  Vector3d origin, u, v;
  Texture texture;
  // Position of the rectangle in the pattern of its texture, in metres. The rectangles of one wall have the same
  // texture and different pattern origins, so that the pattern continues across them.
  Vector2d pattern_origin = Vector2d::Zero();
  double min_texel = 0;  // metres; for surfaces that are hardly seen, texels are at least this large
};

// Returns the distance in metres from a point to the nearest surface, or infinity if there are no surfaces.
double distance_to_surfaces(std::span<const Surface> surfaces, const Vector3d& point);

// A box: the centre of its bottom face, the side lengths along its local x, y and z axes, and its rotation about z.
struct Box {
  Vector3d bottom_centre;
  Vector3d size;
  double yaw = 0.0;  // radians
};

// Appends the side faces and the top face of `box` to `surfaces`, and its bottom face if the box is above the floor.
// `sides` and `top` are the textures; the seed of each face is derived from the seed of its texture.
void add_box(std::vector<Surface>& surfaces, const Box& box, const Texture& sides, const Texture& top);

}  // namespace bslam::simulator
