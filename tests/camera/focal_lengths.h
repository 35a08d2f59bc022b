// Cameras with wrong focal lengths for tests.
#pragma once

#include "camera/camera.h"
#include "camera/model_parameters.h"

namespace bslam::camera {

// The camera with focal lengths that are longer by this factor.
inline Camera zoomed(Camera camera, double factor) {
  ModelParameters p = parameters(camera.model);
  p.head<2>() *= factor;
  camera.model = with_parameters(camera.model, p);
  return camera;
}

}  // namespace bslam::camera
