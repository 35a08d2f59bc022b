// Textured rectangles: all that the built-in world is made of.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "simulator/material.h"

namespace bslam::simulator {

using Eigen::Vector2d;
using Eigen::Vector3d;

// The rectangle origin + a u + b v with a, b in [0, 1]; u and v are perpendicular edges in metres, world frame; u x v
// points to the side that is seen and lit.
struct Surface {
  Vector3d origin, u, v;
  Texture texture;
  // Where the rectangle lies in its pattern, metres: pieces of one wall share the texture and differ in this.
  Vector2d pattern_origin = Vector2d::Zero();
};

// Distance from a point to the nearest surface in metres; infinity where there is none.
double distance_to_surfaces(const std::vector<Surface>& surfaces, const Vector3d& point);

// A box standing on its footprint: centre of the bottom face, full sizes along its own x, y, z, turned by yaw about z.
struct Box {
  Vector3d bottom_centre;
  Vector3d size;
  double yaw = 0.0;  // radians
};

// Appends the sides and the top of `box`, and its bottom where that is above the floor; each face gets a seed of its
// own derived from the texture's.
void add_box(std::vector<Surface>& surfaces, const Box& box, const Texture& sides, const Texture& top);

}  // namespace bslam::simulator
