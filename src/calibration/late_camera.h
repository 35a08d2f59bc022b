// Finds a camera whose images are one frame late: numbered or stamped such that they are together with images that the
// other cameras took one frame before or after.
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
  bool early = false;  // instead of late
  // Matches between the two cameras, and how many are consistent with the calibration: of images of the same frame, and
  // of those that are one frame apart.
  int matches = 0, agreeing = 0, matches_apart = 0, agreeing_apart = 0;
  std::string part = {};  // of the recording in which it is: "first half", "last quarter"; empty if in all of it
};

// Compares images of overlapping cameras at the same frame and one frame apart. `triples`: frames in groups of three
// that follow each other. Only if the rig moves between frames can it be told, and only if the images of a frame were
// taken together. If several pairs of cameras show a difference, the camera of most of them is returned. If the
// triples together show none, their halves and quarters at the ends are tested. `masks` as in check_conventions.
std::optional<LateCamera> find_late_camera(const camera::Rig& rig, std::span<const image::ImageBundle> triples,
                                           std::span<const image::Image> masks);

// A warning that names the camera.
std::string describe_late_camera(const LateCamera& late, const std::string& camera, const std::string& reference);

}  // namespace bslam::calibration
