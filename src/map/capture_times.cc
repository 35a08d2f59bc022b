// BundledMap::correct_time
#include <memory>

#include "map/bundled_map.h"

namespace bslam::map {

bool BundledMap::correct_time(const CaptureTime& change) {
  if (!alive(change.keyframe)) return false;
  BundledKeyframe& keyframe = edit(change.keyframe);
  frame::BundledFrame frame = *keyframe.frame;  // shares its arrays
  frame.cameras[change.camera.index()].set_correction(change.correction_ns);
  keyframe.frame = std::make_shared<const frame::BundledFrame>(std::move(frame));
  return true;
}

}  // namespace bslam::map
