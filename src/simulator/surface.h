// Textured rectangles, of which the built-in world consists.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "simulator/material.h"

namespace bslam::simulator {

using Eigen::Vector2d;
using Eigen::Vector3d;

// The rectangle origin + a u + b v with a, b in [0, 1]. u and v are perpendicular edges in metres, in the world frame.
// u x v points to the visible and lit side.
struct Surface {
  Vector3d origin, u, v;
  Texture texture;
  // Position of the rectangle in its pattern, metres. Pieces of a wall have the same texture and differ in this.
  Vector2d pattern_origin = Vector2d::Zero();
};

// Distance from a point to the nearest surface in metres; infinity if there are no surfaces.
double distance_to_surfaces(const std::vector<Surface>& surfaces, const Vector3d& point);

// A box: centre of its bottom face, side lengths along its own x, y, z, and rotation by yaw about z.
struct Box {
  Vector3d bottom_centre;
  Vector3d size;
  double yaw = 0.0;  // radians
};

// Appends the sides and the top of `box`, and its bottom if that is above the floor. The seed of every face is derived
// from the seed of the texture.
void add_box(std::vector<Surface>& surfaces, const Box& box, const Texture& sides, const Texture& top);

}  // namespace bslam::simulator
