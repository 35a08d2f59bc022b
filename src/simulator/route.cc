#include "simulator/route.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/random.h"
#include "simulator/walls.h"

namespace bslam::simulator {
namespace {

constexpr double kRightOfMiddle = 1.0;  // metres to the right of the middle of the street
constexpr double kRadius = 7.5;         // metres: of corners
constexpr double kLoopLength = 600;     // metres: mean length of a loop
constexpr int kAttempts = 40;           // pieces of street at which a loop is tried

// A crossing of the streets i and j.
struct Crossing {
  std::size_t i = 0, j = 0;
  bool operator==(const Crossing&) const = default;
};

using Walk = std::vector<Crossing>;  // closed: crossings in order, each one a street away from the next

// A loop around the rectangle of streets between two crossings.
struct Loop {
  Crossing low, high;
  bool left = false;  // direction of its turns
};

double length_of(const StreetGrid& grid, const Loop& loop) {
  const Vector2d size = grid.crossing(loop.high.i, loop.high.j) - grid.crossing(loop.low.i, loop.low.j);
  constexpr double kShortcut = 4 * (2 - 0.5 * std::numbers::pi) * kRadius;  // by its four rounded corners
  return 2 * size.sum() - kShortcut + (loop.left ? 8 : -8) * kRightOfMiddle;
}

// The crossings of a loop in the order of driving, from its lower left one.
Walk crossings_of(const Loop& loop) {
  Walk walk;
  const Crossing &a = loop.low, &b = loop.high;
  for (std::size_t i = a.i; i < b.i; ++i) walk.push_back({i, a.j});
  for (std::size_t j = a.j; j < b.j; ++j) walk.push_back({b.i, j});
  for (std::size_t i = b.i; i > a.i; --i) walk.push_back({i, b.j});
  for (std::size_t j = b.j; j > a.j; --j) walk.push_back({a.i, j});
  if (!loop.left) std::reverse(walk.begin(), walk.end());
  return walk;
}

// Calls `visit` for all loops on the inner streets.
template <typename Visit>
void for_each_loop(const Visit& visit) {
  constexpr std::size_t kEnd = StreetGrid::kStreets - 1;
  for (std::size_t i0 = 1; i0 < kEnd; ++i0) {
    for (std::size_t i1 = i0 + 1; i1 < kEnd; ++i1) {
      for (std::size_t j0 = 1; j0 < kEnd; ++j0) {
        for (std::size_t j1 = j0 + 1; j1 < kEnd; ++j1) {
          for (const bool left : {false, true}) visit(Loop{{i0, j0}, {i1, j1}, left});
        }
      }
    }
  }
}

// Whether a loop contains the piece of street from `a` to the next crossing `b`, in this direction.
bool contains(const Loop& loop, const Crossing& a, const Crossing& b) {
  const bool inside = std::min(a.i, b.i) >= loop.low.i && std::max(a.i, b.i) <= loop.high.i &&
                      std::min(a.j, b.j) >= loop.low.j && std::max(a.j, b.j) <= loop.high.j;
  if (!inside) return false;
  const bool forward = a.j == b.j ? b.i > a.i : b.j > a.j;
  // A loop to the left leads east in the south, north in the east, west in the north and south in the west.
  if (a.j == b.j) return a.j == (forward == loop.left ? loop.low.j : loop.high.j);
  return a.i == (forward == loop.left ? loop.high.i : loop.low.i);
}

// A loop that can be driven from one of the pieces of a walk, and the place of this piece.
struct Insertion {
  Loop loop;
  std::size_t at = 0;
  double mismatch = 1e9;  // metres between wanted and actual length
};

// The loop of a length that is closest to the wanted one. `spread` metres of difference are ignored, for variety.
Insertion best_loop(const StreetGrid& grid, const Walk& walk, double wanted, double spread, Random& random) {
  Insertion best;
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    const std::size_t at = random.below(static_cast<std::uint32_t>(walk.size() - 1));
    const Crossing &a = walk[at], &b = walk[at + 1];
    for_each_loop([&](const Loop& loop) {
      if (!contains(loop, a, b)) return;
      const double mismatch = std::abs(length_of(grid, loop) - wanted) + random.uniform() * spread;
      if (mismatch < best.mismatch) best = {loop, at, mismatch};
    });
  }
  return best;
}

// The loop that is closest to the wanted length, on any streets.
Loop first_loop(const StreetGrid& grid, double wanted, double spread, Random& random) {
  Loop best;
  double least = 1e9;
  for_each_loop([&](const Loop& loop) {
    const double mismatch = std::abs(length_of(grid, loop) - wanted) + random.uniform() * spread;
    if (mismatch < least) least = mismatch, best = loop;
  });
  return best;
}

// Drives a loop after the piece of street at `insertion.at`, up to the end of this piece.
void insert(Walk& walk, const Insertion& insertion) {
  Walk loop = crossings_of(insertion.loop);
  const auto start = std::find(loop.begin(), loop.end(), walk[insertion.at + 1]);
  std::rotate(loop.begin(), start, loop.end());
  loop.push_back(loop.front());
  loop.erase(loop.begin());  // the first crossing is already there, and is reached again at the end
  walk.insert(walk.begin() + static_cast<std::ptrdiff_t>(insertion.at) + 2, loop.begin(), loop.end());
}

// The corners of the lane that the walk leads along.
std::vector<Vector2d> corners_of(const StreetGrid& grid, const Walk& walk) {
  std::vector<Vector2d> corners;
  const auto place = [&](std::size_t k) {
    const Crossing& c = walk[k % walk.size()];
    return grid.crossing(c.i, c.j);
  };
  for (std::size_t k = 0; k < walk.size(); ++k) {
    const Vector2d here = place(k), in = (here - place(k + walk.size() - 1)).normalized(),
                   out = (place(k + 1) - here).normalized();
    if (in.dot(out) > 0.5) continue;  // straight on
    corners.push_back(here + kRightOfMiddle * (Vector2d(in.y(), -in.x()) + Vector2d(out.y(), -out.x())));
  }
  return corners;
}

}  // namespace

ClosedPath make_route(const StreetGrid& grid, double length, std::uint64_t seed) {
  constexpr double kStep = 0.25;  // metres
  Random random(seed, "route");
  const int loops = std::max(1, static_cast<int>(std::lround(length / kLoopLength)));
  double left = length;
  Walk walk;
  for (int k = 0; k < loops; ++k) {
    const bool last = k + 1 == loops;
    const double wanted = last ? left : left / (loops - k) * random.uniform(0.7, 1.3), spread = last ? 0 : 100;
    Insertion next;
    if (walk.empty()) {
      next.loop = first_loop(grid, wanted, spread, random);
      walk = crossings_of(next.loop);
    } else {
      next = best_loop(grid, walk, wanted, spread, random);
      insert(walk, next);
    }
    left -= length_of(grid, next.loop);
  }
  return ClosedPath(rounded_loop(corners_of(grid, walk), kRadius, kStep));
}

}  // namespace bslam::simulator
