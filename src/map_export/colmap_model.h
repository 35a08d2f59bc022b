// Maps as models of COLMAP, in its text format with rigs and frames (COLMAP 3.12 and later; earlier versions ignore the
// additional files).
#pragma once

#include <string>
#include <vector>

#include "base/result.h"
#include "map_export/image_table.h"
#include "map_export/landmark_colours.h"
#include "map_export/output_cameras.h"

namespace bslam::map_export {

struct ColmapModel {
  std::string rigs, frames, cameras, images, points;  // rigs.txt, frames.txt, cameras.txt, images.txt, points3D.txt
  std::size_t landmarks = 0;                          // number of points: landmarks that an image of the model shows
  double mean_error_px = 0;        // mean over the points of their mean reprojection errors, as by COLMAP
  std::vector<std::string> notes;  // what COLMAP cannot hold
};

// The model has one image with its keypoints for each entry of `images`, and a point for every landmark. 0.5 is added
// to pixel coordinates, since the origin is the corner of the top-left pixel in COLMAP and its centre in bslam. The
// cameras of each rig of the map are one rig, and the images of a keyframe one frame; but a rig of its own for each
// camera if images of a keyframe were captured at times so different that a rigid rig does not explain them. Error
// (file left empty) if COLMAP does not have the model of a camera.
Result<ColmapModel> colmap_model(const Selection& selection, const ImageTable& images, const OutputCameras& cameras,
                                 const LandmarkColours& colours);

// The largest distance in pixels between projections of observed landmarks into a camera at the capture time of its
// image and at the time of the keyframe. 0 if all cameras are synchronised.
double largest_capture_shift_px(const Selection& selection);

}  // namespace bslam::map_export
