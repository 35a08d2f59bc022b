// The map as a two-dimensional occupancy map, as the map server of ROS navigation (nav2) reads it.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/result.h"
#include "map_export/rays.h"

namespace bslam::map_export {

// Heights relative to camera 0, in map units: what lies between them is an obstacle.
struct HeightBand {
  double below = -0.5, above = 0.5;
};

enum class Cell : std::uint8_t { kUnknown, kFree, kOccupied };

struct OccupancyGrid {
  double resolution = 0;      // map units per cell
  double x = 0, y = 0;        // lower left corner of the first cell
  int width = 0, height = 0;  // cells along x and y
  std::vector<Cell> cells;    // row by row, y upward
  Cell at(int column, int row) const { return cells[static_cast<std::size_t>(row) * width + column]; }
};

// Carves free space along the parts of rays that are within the band, around the height of camera 0 of their keyframe,
// and marks the cells of landmarks within the band. Cells with few observations remain unknown. Error (file left
// empty): the map would have more than 10^8 cells; that of not_interrupted.
Result<OccupancyGrid> occupancy_grid(const std::vector<Scan>& scans, const CarvingOptions& options,
                                     const HeightBand& band, const std::stop_token& interrupted = {});

// The image of a grid (PGM: 0 occupied, 205 unknown, 254 free; y upward), and its description for the map server.
// `comments`: lines at the top of the description, without `#`.
std::string grid_pgm(const OccupancyGrid& grid);
std::string grid_yaml(const OccupancyGrid& grid, const std::string& image, const std::vector<std::string>& comments);

}  // namespace bslam::map_export
