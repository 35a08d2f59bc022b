// Exports of free and occupied space: OctoMap and nav2.
#include <fmt/format.h>

#include <algorithm>

#include "base/atomic_file.h"
#include "evaluation/trajectory_file.h"
#include "map_export/map_exporter.h"
#include "map_export/octree.h"
#include "storage/submaps.h"

namespace bslam::map_export {
namespace {

CarvingOptions carving_options(const Exporter& exporter) {
  constexpr double kRangePerDepth = 10, kLeastCell_m = 0.05;  // the usual cell of maps to drive by
  const double depth = median_depth(exporter.selection);
  const double least = exporter.map().scale() == map::Scale::kMetric ? kLeastCell_m : 0.0;
  const double resolution = exporter.request.resolution.value_or(std::max(least, default_resolution(depth)));
  return {resolution, exporter.request.max_range.value_or(kRangePerDepth * (depth > 0 ? depth : 1.0))};
}

// The rotation of the upright axes, so that poses can be transformed into them.
std::string axes_text(const Exporter& exporter) {
  const geometry::Quaterniond& q = exporter.selection.T_upright_world.rotation();
  return fmt::format(
      "axes: x forward, y left, z up; this rotation turns positions of the trajectory into these axes, qx qy qz qw: "
      "{:.9f} {:.9f} {:.9f} {:.9f}",
      q.x(), q.y(), q.z(), q.w());
}

// Poses of camera 0 in the frame of the map server, as a file of the format TUM.
std::string keyframes_text(Exporter& exporter) {
  storage::Submap submap;
  submap.keyframes = exporter.selection.keyframes;
  evaluation::Trajectory trajectory = storage::keyframe_trajectory(exporter.map(), submap);
  exporter.note_equal_times(submap.keyframes.size(), trajectory.size(), "keyframes.tum");
  for (evaluation::TimedPose& pose : trajectory)
    pose.T_world_frame = exporter.selection.T_upright_world * pose.T_world_frame;
  return evaluation::tum_text(trajectory, evaluation::trajectory_header("cam0", evaluation::PoseState::kFinal, "map"));
}

}  // namespace

Status export_octomap(Exporter& exporter) {
  const CarvingOptions options = carving_options(exporter);
  const auto octree = octree_of(scans_of(exporter.selection), options, exporter.request.interrupted);
  if (!octree) return octree.error();
  exporter.note(axes_text(exporter));
  exporter.note_upward();
  exporter.report.summary =
      fmt::format("cells of {:g}, {} occupied and {} free leaves", options.resolution, octree->occupied, octree->free);
  return write_atomically(exporter.request.out, octree->bytes);
}

Status export_nav2(Exporter& exporter) {
  const CarvingOptions options = carving_options(exporter);
  const HeightBand& band = exporter.request.band;
  auto folder = AtomicFolder::create(exporter.request.out, exporter.request.overwrite);
  if (!folder) return folder.error();
  const auto grid = occupancy_grid(scans_of(exporter.selection), options, band, exporter.request.interrupted);
  if (!grid) return grid.error();
  const std::vector<std::string> comments = {
      axes_text(exporter),
      fmt::format("obstacles between {:g} and {:g} above camera 0, whose keyframes are in keyframes.tum", band.below,
                  band.above)};
  if (Status s = folder->write("map.pgm", grid_pgm(*grid)); !s) return s;
  if (Status s = folder->write("map.yaml", grid_yaml(*grid, "map.pgm", comments)); !s) return s;
  if (Status s = folder->write("keyframes.tum", keyframes_text(exporter)); !s) return s;
  exporter.note_upward();
  exporter.report.summary = fmt::format("{} x {} cells of {:g}", grid->width, grid->height, options.resolution);
  return folder->commit();
}

}  // namespace bslam::map_export
