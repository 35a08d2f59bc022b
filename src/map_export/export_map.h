// Writes a map in the format of another program.
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "dataset/dataset.h"
#include "geometry/up_axis.h"
#include "map/bundled_map.h"
#include "map_export/occupancy_grid.h"

namespace bslam::map_export {

// kFolder: landmarks, keyframes and calibration in formats of bslam's own, and a COLMAP model.
enum class Format { kFolder, kColmap, kPly, kG2o, kNerfstudio, kOctomap, kNav2 };

struct FormatName {
  std::string_view name;  // on the command line
  Format format;
  bool is_folder;               // whether a folder is written, or a file
  std::string_view begin = {};  // with which the file begins
};
std::span<const FormatName> formats();  // all but kFolder

struct ExportRequest {
  Format format = Format::kFolder;
  std::filesystem::path out;
  bool overwrite = false;                  // replace files of `out`
  const dataset::Dataset* data = nullptr;  // the recording of the map, for names, colours and images; may be null
  std::filesystem::path data_folder;       // names of images are relative to it
  bool undistort = false;                  // kColmap, kNerfstudio: write undistorted images and pinhole cameras
  std::optional<std::size_t> submap;       // default: the one with most landmarks
  std::optional<double> resolution;        // kOctomap, kNav2: side of a cell; default: default_resolution, >= 5 cm
  std::optional<double> max_range;         // kOctomap, kNav2: default: ten times the median depth
  HeightBand band;                         // kNav2
  std::optional<geometry::UpAxis> up;      // kNerfstudio, kOctomap, kNav2: default: upward_note()
  std::stop_token interrupted;             // a stop request ends the export, and nothing is written
};

// A note for the user about the vertical direction that is used if `up` is not given.
std::string upward_note();

struct ExportReport {
  std::vector<std::string> notes;  // what the user should know, one sentence each
  std::string summary;             // what was written
};

// Writes `request.out`, completely or not at all. With `overwrite`, files of an existing folder are replaced by those
// of the same names, and its other files stay, since they may not be those of an export; after an error the folder is
// unchanged, but not if the program is killed while files are moved there. Errors: the map is empty; `out` exists and
// is not to be overwritten, or cannot be written; none of the images of the map is in the recording; the format cannot
// hold a camera; options that do not fit the format; that of not_interrupted.
Result<ExportReport> export_map(const map::BundledMap& map, const ExportRequest& request);

}  // namespace bslam::map_export
