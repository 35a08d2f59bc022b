#include "map_export/octree.h"

#include <fmt/format.h>
#include <octomap/octomap.h>

#include <sstream>

#include "base/interrupted.h"

namespace bslam::map_export {
namespace {

octomap::point3d point(const Eigen::Vector3d& p) {
  return {static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())};
}

// Adds one image. Returns false if a cell is outside of the tree.
bool insert(const Scan& scan, const CarvingOptions& options, octomap::OcTree& tree) {
  octomap::KeySet free, occupied;
  octomap::KeyRay cells;
  octomap::OcTreeKey begin, end;
  if (!tree.coordToKeyChecked(point(scan.origin), begin)) return false;
  for (const Ray& ray : scan.rays) {
    const CarvedRay carved = carve(scan.origin, ray, options);
    if (!tree.coordToKeyChecked(point(carved.free_end), end)) return false;
    if (!tree.computeRayKeys(point(scan.origin), point(carved.free_end), cells)) return false;
    free.insert(cells.begin(), cells.end());
    if (!carved.occupied) continue;
    if (!tree.coordToKeyChecked(point(ray.end), end)) return false;
    occupied.insert(end);
  }
  for (const octomap::OcTreeKey& key : free) {
    if (occupied.count(key) == 0) tree.updateNode(key, false, true);
  }
  for (const octomap::OcTreeKey& key : occupied) tree.updateNode(key, true, true);
  return true;
}

}  // namespace

Result<OctreeFile> octree_of(const std::vector<Scan>& scans, const CarvingOptions& options,
                             const std::stop_token& interrupted) {
  octomap::OcTree tree(options.resolution);
  for (const Scan& scan : scans) {
    if (Status s = not_interrupted(interrupted); !s) return s.error();
    if (!insert(scan, options, tree))
      return Error{"", "--resolution", std::to_string(options.resolution),
                   "larger cells: an octree has 65536 cells along each side"};
  }
  tree.updateInnerOccupancy();
  tree.toMaxLikelihood();
  tree.prune();
  OctreeFile file;
  for (auto leaf = tree.begin_leafs(), end = tree.end_leafs(); leaf != end; ++leaf)
    ++(tree.isNodeOccupied(*leaf) ? file.occupied : file.free);
  // As OcTree::writeBinary, which also prints.
  std::ostringstream out;
  out << fmt::format("# Octomap OcTree binary file\nid {}\nsize {}\nres {}\ndata\n", tree.getTreeType(), tree.size(),
                     options.resolution);
  tree.writeBinaryData(out);
  file.bytes = std::move(out).str();
  return file;
}

}  // namespace bslam::map_export
