// What a public Rig hides.
#pragma once

#include <bslam/rig.h>

#include <string>
#include <vector>

#include "camera/rig.h"
#include "image/image.h"

namespace bslam {

struct Rig::Impl {
  camera::Rig rig;
  std::vector<image::Image> masks;  // one per camera, an empty image = none
  std::vector<std::string> notes;
};

namespace api {

Rig make_rig(camera::Rig rig, std::vector<image::Image> masks = {}, std::vector<std::string> notes = {});

}  // namespace api
}  // namespace bslam
