#include "map_export/occupancy_grid.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>

#include "base/interrupted.h"

namespace bslam::map_export {
namespace {

constexpr double kMaxCells = 2e7;  // a grid of this size takes 340 MB

// A part of a line of sight in the plane.
struct Segment {
  Eigen::Vector2d from, to;
};

// The part of the segment from `a` to `b` with heights in [low, high].
std::optional<Segment> within(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double low, double high) {
  double begin = 0, end = 1;
  const double rise = b.z() - a.z();
  if (std::abs(rise) < 1e-12) {
    if (a.z() < low || a.z() > high) return std::nullopt;
  } else {
    const double at_low = (low - a.z()) / rise, at_high = (high - a.z()) / rise;
    begin = std::max(begin, std::min(at_low, at_high));
    end = std::min(end, std::max(at_low, at_high));
    if (begin >= end) return std::nullopt;
  }
  const Eigen::Vector2d direction = (b - a).head<2>();
  return Segment{a.head<2>() + begin * direction, a.head<2>() + end * direction};
}

// The observations of all cells. Cells are numbered row by row.
class Observations {
 public:
  Observations(const Eigen::AlignedBox2d& box, double resolution)
      : origin_(box.min()),
        resolution_(resolution),
        width_(static_cast<int>(std::floor(box.sizes().x() / resolution)) + 1),
        height_(static_cast<int>(std::floor(box.sizes().y() / resolution)) + 1),
        hits_(static_cast<std::size_t>(width_) * height_),
        misses_(hits_.size()),
        last_hit_(hits_.size(), -1),
        last_miss_(hits_.size(), -1) {}

  // Each cell is counted once per scan, and as a hit if the scan has both.
  void add(const Scan& scan, int number, const CarvingOptions& options, const HeightBand& band) {
    const double low = scan.height + band.below, high = scan.height + band.above;
    for (const Ray& ray : scan.rays) {
      if (!carve(scan.origin, ray, options).occupied || ray.end.z() < low || ray.end.z() > high) continue;
      const std::size_t cell = cell_of(ray.end.head<2>());
      if (last_hit_[cell] != number) ++hits_[cell];
      last_hit_[cell] = number;
    }
    for (const Ray& ray : scan.rays) {
      const auto free = within(scan.origin, carve(scan.origin, ray, options).free_end, low, high);
      if (free) add_free(*free, number);
    }
  }

  OccupancyGrid grid() const {
    OccupancyGrid grid{resolution_, origin_.x(), origin_.y(), width_, height_, std::vector<Cell>(hits_.size())};
    for (std::size_t i = 0; i < hits_.size(); ++i) grid.cells[i] = state(hits_[i], misses_[i]);
    return grid;
  }

 private:
  // The sensor model of OctoMap: probabilities 0.7 and 0.4 of being occupied after a hit and a miss. A landmark has to
  // be seen by several images.
  static Cell state(int hits, int misses) {
    constexpr double kHit = 0.847, kMiss = -0.405, kOccupied = 2.0, kFree = -0.8;  // log odds
    const double odds = kHit * hits + kMiss * misses;
    if (odds >= kOccupied) return Cell::kOccupied;
    return odds <= kFree ? Cell::kFree : Cell::kUnknown;
  }

  int column_of(double x) const {
    return std::clamp(static_cast<int>(std::floor((x - origin_.x()) / resolution_)), 0, width_ - 1);
  }
  int row_of(double y) const {
    return std::clamp(static_cast<int>(std::floor((y - origin_.y()) / resolution_)), 0, height_ - 1);
  }
  std::size_t cell_of(const Eigen::Vector2d& p) const {
    return static_cast<std::size_t>(row_of(p.y())) * width_ + column_of(p.x());
  }

  void add_miss(std::size_t cell, int number) {
    if (last_hit_[cell] == number || last_miss_[cell] == number) return;
    last_miss_[cell] = number;
    ++misses_[cell];
  }

  // Visits the cells of a segment in order (Amanatides and Woo, 1987).
  void add_free(const Segment& segment, int number) {
    const Eigen::Vector2d direction = segment.to - segment.from;
    int column = column_of(segment.from.x()), row = row_of(segment.from.y());
    const int last_column = column_of(segment.to.x()), last_row = row_of(segment.to.y());
    const int step_x = direction.x() < 0 ? -1 : 1, step_y = direction.y() < 0 ? -1 : 1;
    // Fractions of the segment until the next border in x and y, and between borders.
    const auto until = [&](int cell, int step, double from, double origin, double length) {
      return length == 0 ? HUGE_VAL : (origin + (cell + (step > 0 ? 1 : 0)) * resolution_ - from) / length;
    };
    double next_x = until(column, step_x, segment.from.x(), origin_.x(), direction.x());
    double next_y = until(row, step_y, segment.from.y(), origin_.y(), direction.y());
    const double width = resolution_ / std::abs(direction.x()), height = resolution_ / std::abs(direction.y());
    for (int steps = std::abs(last_column - column) + std::abs(last_row - row); steps >= 0; --steps) {
      add_miss(static_cast<std::size_t>(row) * width_ + column, number);
      if (next_x < next_y) {
        column = std::clamp(column + step_x, 0, width_ - 1);
        next_x += width;
      } else {
        row = std::clamp(row + step_y, 0, height_ - 1);
        next_y += height;
      }
    }
  }

  Eigen::Vector2d origin_;
  double resolution_;
  int width_, height_;
  std::vector<int> hits_, misses_, last_hit_, last_miss_;  // `last`: number of the last scan that was counted
};

}  // namespace

Result<OccupancyGrid> occupancy_grid(const std::vector<Scan>& scans, const CarvingOptions& options,
                                     const HeightBand& band, const std::stop_token& interrupted) {
  Eigen::AlignedBox2d box;
  for (const Scan& scan : scans) {
    box.extend(scan.origin.head<2>().eval());
    for (const Ray& ray : scan.rays) {
      const Eigen::Vector3d free_end = carve(scan.origin, ray, options).free_end;
      const auto free = within(scan.origin, free_end, scan.height + band.below, scan.height + band.above);
      if (free) box.extend(free->from).extend(free->to);
    }
  }
  if (box.isEmpty()) box.extend(Eigen::Vector2d::Zero().eval());
  const Eigen::Vector2d margin = Eigen::Vector2d::Constant(2 * options.resolution);
  const Eigen::AlignedBox2d padded(box.min() - margin, box.max() + margin);
  if ((padded.sizes() / options.resolution).prod() > kMaxCells)
    return Error{
        "", "--resolution", fmt::format("{}", options.resolution),
        fmt::format("larger cells: the map is {:.0f} x {:.0f} units large", padded.sizes().x(), padded.sizes().y())};
  Observations observations(padded, options.resolution);
  for (std::size_t i = 0; i < scans.size(); ++i) {
    if (Status s = not_interrupted(interrupted); !s) return s.error();
    observations.add(scans[i], static_cast<int>(i), options, band);
  }
  return observations.grid();
}

std::string grid_pgm(const OccupancyGrid& grid) {
  std::string out = fmt::format("P5\n{} {}\n255\n", grid.width, grid.height);
  for (int row = grid.height - 1; row >= 0; --row) {
    for (int column = 0; column < grid.width; ++column) {
      const Cell cell = grid.at(column, row);
      out += static_cast<char>(cell == Cell::kFree ? 254 : cell == Cell::kOccupied ? 0 : 205);
    }
  }
  return out;
}

std::string grid_yaml(const OccupancyGrid& grid, const std::string& image, const std::vector<std::string>& comments) {
  std::string out;
  for (const std::string& comment : comments) out += "# " + comment + "\n";
  return out + fmt::format(
                   "image: {}\nmode: trinary\nresolution: {}\norigin: [{}, {}, 0.0]\nnegate: 0\noccupied_thresh: 0.65\n"
                   "free_thresh: 0.196\n",
                   image, grid.resolution, grid.x, grid.y);
}

}  // namespace bslam::map_export
