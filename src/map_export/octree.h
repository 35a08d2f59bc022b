// The map as an occupancy octree of OctoMap.
#pragma once

#include <stop_token>
#include <string>
#include <vector>

#include "base/result.h"
#include "map_export/rays.h"

namespace bslam::map_export {

struct OctreeFile {
  std::string bytes;                   // a .bt file
  std::size_t occupied = 0, free = 0;  // number of leaves
};

// Carves free space along all rays, image by image: a cell with a landmark of an image is occupied, whatever rays of
// the same image pass through it. Probabilities are those of OctoMap. Error (file left empty): the cells are too small
// for the extent of the map (an octree of OctoMap has 65536 cells along each side); that of not_interrupted.
Result<OctreeFile> octree_of(const std::vector<Scan>& scans, const CarvingOptions& options,
                             const std::stop_token& interrupted = {});

}  // namespace bslam::map_export
