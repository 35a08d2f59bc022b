// Start of a map by overlapping cameras that capture at different times: images of several cameras can only be compared
// once the motion between them is known.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "estimators/baseline_scale.h"
#include "frame/bundled_frame.h"

namespace bslam::tracking {

// Returns true if cameras of the second frame captured at different times, but the images of each camera hardly changed
// since the first one, shortly before, so that they can be compared all the same.
bool at_rest(const frame::BundledFrame& first, const frame::BundledFrame& second);

// Points and motion of one camera between two images, up to scale.
struct TwoImages {
  CameraIndex camera;
  const frame::CameraFrame& first;
  const frame::CameraFrame& second;
  geometry::SE3 T_second_first;                        // of the camera
  std::vector<std::optional<Eigen::Vector3d>> points;  // per keypoint of the first image, in the camera
};

struct ScaleFromOtherTimes {
  estimators::BaselineScale scale;  // metres per unit of the images
  // Mean velocity of the camera for some tenths of a second at the first and at the second image, as
  // camera::Rig::moving, up to scale.
  std::array<geometry::Vector6d, 2> twists;
};

// The scale from images in which other cameras show the same points at other times. The camera was then where its poses
// in `frames`, which are estimated from the points, show it by constant acceleration. Cameras that also capture
// together with the camera are left out, since their matches show the scale. Returns nullopt if other cameras show too
// few of the points, or if there are no such images between the two.
std::optional<ScaleFromOtherTimes> scale_from_other_times(const camera::Rig& rig, const TwoImages& images,
                                                          std::span<const frame::BundledFrame* const> frames);

}  // namespace bslam::tracking
