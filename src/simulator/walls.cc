#include "simulator/walls.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace bslam::simulator {
namespace {

// Adds a rectangle of a face, between two positions along it and two heights.
void add_wall_piece(Building& b, const Face& f, double from, double to, double low, double high,
                    const Texture& texture) {
  b.surfaces.push_back({at_height(f.start + to * f.direction, low), at_height((from - to) * f.direction, 0),
                        Vector3d(0, 0, high - low), texture, Vector2d(-to, low)});
}

}  // namespace

Texture texture(Material material, float shade, Random& random) {
  return {material, static_cast<std::uint32_t>(random.next()), shade};
}

Vector2d centre_of(const Door& d) {
  return d.along == Axis::kX ? Vector2d(d.centre, d.wall) : Vector2d(d.wall, d.centre);
}

std::array<Face, 4> faces_of(const Room& r, const Vector2d& low, const Vector2d& high) {
  const auto face = [&](const Vector2d& start, const Vector2d& direction, Axis along, double wall, double inner) {
    const Vector2d size = r.high - r.low;
    return Face{start, direction, along == Axis::kX ? size.x() : size.y(), along, wall, wall == inner};
  };
  return {face(r.low, {1, 0}, Axis::kX, low.y(), r.low.y()),
          face({r.high.x(), r.low.y()}, {0, 1}, Axis::kY, high.x(), r.high.x()),
          face(r.high, {-1, 0}, Axis::kX, high.y(), r.high.y()),
          face({r.low.x(), r.high.y()}, {0, -1}, Axis::kY, low.x(), r.low.x())};
}

std::vector<WallSegment> add_face(Building& b, const Face& f, std::span<const Door> doors, double height,
                                  const Texture& texture) {
  std::vector<double> openings;  // distances along the face
  for (const Door& d : doors) {
    const double at = (centre_of(d) - f.start).dot(f.direction);
    if (d.along == f.along && d.wall == f.wall && at > 0 && at < f.length) openings.push_back(at);
  }
  std::sort(openings.begin(), openings.end());
  std::vector<WallSegment> segments;
  double from = 0;
  const auto close = [&](double to, double left_overlap, double right_overlap) {
    add_wall_piece(b, f, from - left_overlap, to + right_overlap, -kOverlap, height + kOverlap, texture);
    segments.push_back({f.start + from * f.direction, f.direction, to - from, f.outer});
  };
  for (const double at : openings) {
    close(at - 0.5 * kDoorWidth, from == 0 ? kOverlap : 0, 0);
    from = at + 0.5 * kDoorWidth;
    add_wall_piece(b, f, at - 0.5 * kDoorWidth, from, kDoorHeight, height + kOverlap, texture);
  }
  close(f.length, from == 0 ? kOverlap : 0, kOverlap);
  return segments;
}

void add_door(Building& b, const Door& d, Random& random) {
  const Texture wood{Material::kWood, static_cast<std::uint32_t>(random.next()), random.uniform() < 0.5 ? 0.25f : 0.7f};
  const Vector2d along = d.along == Axis::kX ? Vector2d(1, 0) : Vector2d(0, 1);
  const Vector2d across(-along.y(), along.x()), c = centre_of(d);
  const double half = 0.5 * kDoorWidth, depth = kHalfWall + kOverlap;
  for (const double side : {-1.0, 1.0}) {
    Texture jamb = wood;
    jamb.seed += side > 0 ? 1 : 2;
    const Vector2d inwards = -side * across;  // normal that points into the opening
    b.surfaces.push_back({at_height(c + side * half * along - depth * inwards, -kOverlap),
                          at_height(2 * depth * inwards, 0), Vector3d(0, 0, kDoorHeight + 2 * kOverlap), jamb});
    const Vector2d post = c + side * (half + 0.5 * kCasing) * along;
    const double yaw = std::atan2(along.y(), along.x());
    for (const double face : {-1.0, 1.0}) {
      const Vector2d offset = face * (kHalfWall + 0.01) * across;
      add_box(b.surfaces, {at_height(post + offset, 0), {kCasing, 0.02, kDoorHeight + kCasing}, yaw}, jamb, jamb);
      if (side > 0)
        add_box(b.surfaces, {at_height(c + offset, kDoorHeight), {kDoorWidth, 0.02, kCasing}, yaw}, wood, wood);
    }
  }
  const Vector3d corner = at_height(c - half * along - depth * across, kDoorHeight);
  b.surfaces.push_back({corner, at_height(2 * depth * across, 0), at_height(2 * half * along, 0), wood});
  b.surfaces.push_back({corner - Vector3d(0, 0, kDoorHeight - 0.002), at_height(2 * half * along, 0),
                        at_height(2 * depth * across, 0), wood});
}

std::vector<Vector2d> rounded_loop(const std::vector<Vector2d>& corners, double radius, double step) {
  std::vector<Vector2d> fine;
  const std::size_t n = corners.size();
  const auto line = [&](const Vector2d& from, const Vector2d& to) {
    const int count = std::max(1, static_cast<int>((to - from).norm() / step));
    for (int i = 0; i < count; ++i) fine.push_back(from + (to - from) * i / count);
  };
  Vector2d last = 0.5 * (corners[0] + corners[1]);
  const Vector2d first = last;
  for (std::size_t k = 1; k <= n; ++k) {
    const Vector2d& corner = corners[k % n];
    const Vector2d in = (corner - corners[k - 1]).normalized(), out = (corners[(k + 1) % n] - corner).normalized();
    const double turn = std::atan2(in.x() * out.y() - in.y() * out.x(), in.dot(out));
    const double reach = radius * std::tan(0.5 * std::abs(turn)), side = turn > 0 ? 1.0 : -1.0;
    const Vector2d begin = corner - reach * in, centre = begin + side * radius * Vector2d(-in.y(), in.x());
    line(last, begin);
    const int count = std::max(1, static_cast<int>(radius * std::abs(turn) / step));
    for (int i = 0; i < count; ++i) fine.push_back(centre + Eigen::Rotation2Dd(turn * i / count) * (begin - centre));
    last = corner + reach * out;
  }
  line(last, first);
  return fine;
}

}  // namespace bslam::simulator
