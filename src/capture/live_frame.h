// Images of live cameras on their way to the estimator and into a recording.
#pragma once

#include <bslam/image_bundle.h>

#include <string>
#include <vector>

#include "camera/rig.h"
#include "image/image_bundle.h"

namespace bslam::capture {

// An image of one camera; the owner of the pixels of a bslam::CameraImage.
struct CapturedPixels {
  image::Image grey;
  std::string jpeg;      // the file of the camera from which it was decoded; empty: it delivers pixels
  double read_ms = 0.0;  // time for the conversion
};

const CapturedPixels& pixels_of(const CameraImage& image);

// Returns the time of a bundle: with the time offsets of the rig, that of the image of camera 0 or the earliest one.
TimeNs time_of(const ImageBundle& bundle, const camera::Rig& rig);

// Returns the images as the estimator takes them, with copies of the pixels.
image::ImageBundle frame_of(const ImageBundle& bundle, const camera::Rig& rig, FrameId id);

}  // namespace bslam::capture
