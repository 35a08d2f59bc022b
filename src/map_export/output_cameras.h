// The cameras of an export: those of the rig, or pinhole cameras of undistorted images.
#pragma once

#include <opencv2/core/mat.hpp>
#include <optional>
#include <vector>

#include "camera/rig.h"

namespace bslam::map_export {

// The pinhole camera (square pixels, principal point in the middle, same image size) with the widest field of view that
// the images of `camera` fill completely, but at most 110 degrees along each side of the image.
camera::Camera pinhole_for(const camera::Camera& camera);

class OutputCameras {
 public:
  OutputCameras(const camera::Rig& rig, bool undistort);

  bool undistorted() const { return undistort_; }
  const camera::Camera& camera(std::size_t c) const { return cameras_[c]; }
  // Position in the exported image of a pixel of the recorded image; nullopt if it is outside.
  std::optional<Eigen::Vector2d> pixel(std::size_t c, const Eigen::Vector2f& recorded) const;
  // The exported image of a recorded one, which must have the size of its camera.
  cv::Mat image(std::size_t c, const cv::Mat& recorded);

 private:
  camera::Rig rig_;
  bool undistort_;
  std::vector<camera::Camera> cameras_;
  std::vector<cv::Mat> maps_;  // per camera, CV_32FC2: pixel of the recorded image or -1; empty until needed
};

}  // namespace bslam::map_export
