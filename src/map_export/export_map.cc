#include "map_export/export_map.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "base/atomic_file.h"
#include "base/interrupted.h"
#include "map_export/map_exporter.h"
#include "map_export/point_cloud.h"
#include "map_export/pose_graph_file.h"
#include "storage/submaps.h"

namespace bslam::map_export {
namespace {

namespace fs = std::filesystem;

constexpr std::array<FormatName, 6> kFormats = {{{"colmap", Format::kColmap, true},
                                                 {"ply", Format::kPly, false, "ply\n"},
                                                 {"g2o", Format::kG2o, false, "VERTEX_SE3:QUAT "},
                                                 {"nerfstudio", Format::kNerfstudio, true},
                                                 {"octomap", Format::kOctomap, false, "# Octomap OcTree "},
                                                 {"nav2", Format::kNav2, true}}};

const FormatName* name_of(Format format) {
  const auto row = std::ranges::find(kFormats, format, &FormatName::format);
  return row == kFormats.end() ? nullptr : &*row;
}

Status check_options(const ExportRequest& request) {
  const FormatName* format = name_of(request.format);
  const std::string name = format ? std::string(format->name) : "a folder without --format";
  const bool has_images = request.format == Format::kColmap || request.format == Format::kNerfstudio;
  if (request.undistort && !has_images)
    return Error{"command line", "--undistort", "--format " + name, "--format colmap or nerfstudio"};
  if (request.undistort && !request.data)
    return Error{"command line", "--undistort", "no --images", "--images DATA, the recording of the map"};
  const bool carves = request.format == Format::kOctomap || request.format == Format::kNav2;
  if ((request.resolution || request.max_range) && !carves)
    return Error{"command line", "--resolution, --max-range", "--format " + name, "--format octomap or nav2"};
  if (request.up && !carves && request.format != Format::kNerfstudio)
    return Error{"command line", "--up", "--format " + name, "--format nerfstudio, octomap or nav2"};
  return {};
}

// A single file is replaced only with --overwrite. Folders are checked by AtomicFolder.
Status check_place(const ExportRequest& request) {
  const FormatName* format = name_of(request.format);
  std::error_code error;
  if (!format || format->is_folder || !fs::exists(request.out, error)) return {};
  if (fs::is_directory(request.out, error)) return Error{request.out.string(), "--out", "a folder", "a file"};
  if (request.overwrite) return {};
  return Error{request.out.string(), "--out", "an existing file", "a new file, or --overwrite"};
}

Status check_images(Exporter& exporter) {
  if (!exporter.request.data) return {};
  const std::size_t all = exporter.images.images().size(), found = exporter.images.found();
  if (all > 0 && found == 0)
    return Error{exporter.request.data_folder.string(), "--images", "none of the images of the map",
                 "the recording from which the map was made"};
  if (found < all)
    exporter.note(fmt::format(
        "{} of {} images of the map are not in {}{}", all - found, all, exporter.request.data_folder.string(),
        exporter.request.undistort ? "; they are left out" : "; they are named CAMERA/STAMP.png"));
  const auto in_recording = [](const MapImage& image) { return image.recorded && image.recorded->path.empty(); };
  if (!exporter.request.undistort && std::ranges::any_of(exporter.images.images(), in_recording))
    exporter.note(
        "the images are inside of a recording, and are named CAMERA/STAMP.png; --undistort writes them as files");
  return {};
}

Status write(Exporter& exporter) {
  if (Status s = not_interrupted(exporter.request.interrupted); !s) return s;
  switch (exporter.request.format) {
    case Format::kColmap:
      return export_colmap(exporter);
    case Format::kPly:
      return export_ply(exporter);
    case Format::kG2o:
      return export_g2o(exporter);
    case Format::kNerfstudio:
      return export_nerfstudio(exporter);
    case Format::kOctomap:
      return export_octomap(exporter);
    case Format::kNav2:
      return export_nav2(exporter);
    case Format::kFolder:
      break;
  }
  return export_folder(exporter);
}

}  // namespace

std::string upward_note() {
  return "upward is that of camera 0 on average: if it is mounted rolled, or looking down or up, the map is tilted as "
         "much; --up names the axis of body or camera that points upward";
}

std::span<const FormatName> formats() { return kFormats; }

LandmarkColours Exporter::colours() {
  LandmarkColours colours = landmark_colours(selection, images, request.interrupted);
  if (!request.data) {
    note("the points are grey: their colours are taken from the images with --images DATA");
  } else if (colours.read < images.images().size()) {
    note(fmt::format("{} of {} images could not be read for the colours of the points",
                     images.images().size() - colours.read, images.images().size()));
  }
  return colours;
}

void Exporter::note_equal_times(std::size_t keyframes, std::size_t poses, const std::string& file) {
  if (poses < keyframes)
    note(fmt::format("{} of {} keyframes have the time of another one, and are not in {}", keyframes - poses, keyframes,
                     file));
}

Status export_ply(Exporter& exporter) {
  const LandmarkColours colours = exporter.colours();
  if (Status s = not_interrupted(exporter.request.interrupted); !s) return s;
  exporter.report.summary = fmt::format("{} landmarks", exporter.selection.landmarks.size());
  return write_atomically(exporter.request.out, landmarks_ply(exporter.selection, colours));
}

Status export_g2o(Exporter& exporter) {
  const PoseGraphFile graph = g2o_text(exporter.selection);
  exporter.report.summary = fmt::format("{} vertices, {} edges", graph.vertices, graph.edges);
  return write_atomically(exporter.request.out, graph.text);
}

Result<ExportReport> export_map(const map::BundledMap& map, const ExportRequest& request) {
  for (const Status& status : {check_options(request), check_place(request)})
    if (!status) return status.error();
  auto selection = select_submap(map, request.submap, request.up);
  if (!selection) return selection.error();
  ImageTable images(*selection, request.data, request.data_folder, request.interrupted);
  if (Status s = not_interrupted(request.interrupted); !s) return s.error();
  Exporter exporter{request, *std::move(selection), std::move(images), OutputCameras(map.rig(), request.undistort), {}};
  if (Status s = check_images(exporter); !s) return s.error();
  const std::size_t submaps = map.roots().size();
  if (submaps > 1 && !request.submap)
    exporter.note(fmt::format(
        "the map has {} submaps whose positions relative to each other are not known; the one with most landmarks was "
        "exported, --submap N selects another one",
        submaps));
  if (map.scale() != map::Scale::kMetric && request.format != Format::kFolder)
    exporter.note("the scale of the map is not metric: lengths are not in metres");
  if (Status s = write(exporter); !s) return s.error();
  return std::move(exporter.report);
}

}  // namespace bslam::map_export
