// Finds a camera whose images are shifted by one frame: by their numbers or time stamps they are grouped with images
// that the other cameras took one frame earlier or later.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "camera/rig.h"
#include "image/image_bundle.h"

namespace bslam::calibration {

struct LateCamera {
  std::size_t camera = 0, reference = 0;
  bool early = false;  // the images are one frame early instead of late
  // Number of matches between the two cameras, and how many of them are consistent with the calibration, for images of
  // the same frame and for images one frame apart.
  int matches = 0, agreeing = 0, matches_apart = 0, agreeing_apart = 0;
  // Part of the recording with the shift, such as "first half" or "last quarter"; empty: the whole recording.
  std::string part = {};
};

// Compares images of overlapping cameras at the same frame and one frame apart. `triples`: groups of three consecutive
// frames, of which those with images that were not taken at the same time do not count. A shift can only be found if
// the rig moves between frames, and if half of the triples count. If several pairs of cameras show a difference, the
// camera of most of them is returned. If the triples together show none, their halves and quarters at the ends are
// tested. `estimated`: the calibration that was estimated from the same recording, with the cameras of `rig`, or `rig`
// itself; with a wrong rotation, images that are one frame apart may fit better than those of the same frame while the
// rig turns steadily, but not better than those of the same frame with the estimate. `masks` as in check_conventions.
std::optional<LateCamera> find_late_camera(const camera::Rig& rig, const camera::Rig& estimated,
                                           std::span<const image::ImageBundle> triples,
                                           std::span<const image::Image> masks);

// A warning that names the camera.
std::string describe_late_camera(const LateCamera& late, const std::string& camera, const std::string& reference);

}  // namespace bslam::calibration
