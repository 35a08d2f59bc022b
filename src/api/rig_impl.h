// Implementation of the public class Rig.
#pragma once

#include <bslam/rig.h>

#include <string>
#include <vector>

#include "camera/rig.h"
#include "image/image.h"

namespace bslam {

struct Rig::Impl {
  camera::Rig rig;
  std::vector<image::Image> masks;  // one per camera; empty if the camera has no mask
  std::vector<std::string> notes;
};

namespace api {

// `masks`: one per camera, or fewer if the last cameras have none; an empty image for a camera without one.
Rig make_rig(camera::Rig rig, std::vector<image::Image> masks = {}, std::vector<std::string> notes = {});

}  // namespace api
}  // namespace bslam
