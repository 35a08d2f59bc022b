// Common base of the exports to all formats. Internal to this folder.
#pragma once

#include "base/atomic_folder.h"
#include "map_export/export_map.h"
#include "map_export/image_table.h"
#include "map_export/landmark_colours.h"
#include "map_export/output_cameras.h"

namespace bslam::map_export {

struct Exporter {
  const ExportRequest& request;
  Selection selection;
  ImageTable images;
  OutputCameras cameras;
  ExportReport report;

  const map::BundledMap& map() const { return *selection.map; }
  void note(std::string text) { report.notes.push_back(std::move(text)); }
  void note_upward() {
    if (!request.up) note(upward_note());
  }
  // Notes keyframes that are not in the trajectory of all that was written to this file, since times must increase.
  void note_equal_times(std::size_t keyframes, std::size_t poses, const std::string& file);
  // The colours of the landmarks; notes if they are grey because there are no images.
  LandmarkColours colours();
};

// Writes undistorted images as images/NAME.png, and their calibration as rig.yaml. From then on, names of images end in
// .png, and images that cannot be read are not in the table; a note says how many. Error: none can be read.
Status write_undistorted(Exporter& exporter, const AtomicFolder& folder);

// Each writes one format.
Status export_folder(Exporter& exporter);
Status export_colmap(Exporter& exporter);
Status export_nerfstudio(Exporter& exporter);
Status export_octomap(Exporter& exporter);
Status export_nav2(Exporter& exporter);
Status export_ply(Exporter& exporter);
Status export_g2o(Exporter& exporter);

}  // namespace bslam::map_export
